// A thread of the program: it does one task on the memory that the page shares.

import init, { run_task } from './sindyscope.js';

globalThis.sindyscopeHost = { wake: () => postMessage('wake') };

onmessage = async ({ data: { module, memory, task } }) => {
  await init({ module_or_path: module, memory, thread_stack_size: 4 << 20 });
  run_task(task);
  postMessage('ended');
};
