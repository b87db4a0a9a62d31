// What the page does for the program: it starts it, starts workers on its memory, keeps files, and hands files over.

import init, { described, open, page_keeps_not, page_woken, run_task } from './sindyscope.js';

const said = document.getElementById('said');
const say = text => { said.textContent = text; };

// Memory that workers share is given only to pages that are isolated from others. Where the server does not say so in its headers, a
// service worker adds them: one reload, at the first visit. Where even that is not to be had, as by plain http from another computer, the page
// computes by itself. True if the page is about to be loaded again.
async function reloads() {
  if (self.crossOriginIsolated) {
    sessionStorage.removeItem('isolating');
    return false;
  }
  if (!navigator.serviceWorker || sessionStorage.getItem('isolating')) return false;
  try {
    sessionStorage.setItem('isolating', 'yes');
    await navigator.serviceWorker.register('isolate.js');
    await navigator.serviceWorker.ready;
  } catch {
    return false;
  }
  location.reload();
  return true;
}

// --- files that are kept

const STORE = 'files';

function database() {
  return new Promise((resolve, reject) => {
    const asked = indexedDB.open('sindyscope', 1);
    asked.onupgradeneeded = () => asked.result.createObjectStore(STORE);
    asked.onsuccess = () => resolve(asked.result);
    asked.onerror = () => reject(asked.error);
  });
}

function keptFiles(base) {
  return new Promise((resolve, reject) => {
    const found = [];
    const asked = base.transaction(STORE).objectStore(STORE).openCursor();
    asked.onsuccess = () => {
      const at = asked.result;
      if (!at) return resolve(found);
      found.push([at.key, at.value]);
      at.continue();
    };
    asked.onerror = () => reject(asked.error);
  });
}

let base = null;
let refused = false;

function keepsNot(error) {
  // Once is enough: each change of the work would say it again.
  if (!refused) page_keeps_not(error?.name === 'QuotaExceededError' ? 'it gives no more room' : String(error?.message ?? error));
  refused = true;
}

function keep(path, bytes) {
  if (!base) return;
  try {
    const change = base.transaction(STORE, 'readwrite');
    if (bytes) change.objectStore(STORE).put(bytes, path);
    else change.objectStore(STORE).delete(path);
    change.oncomplete = () => { refused = false; };
    change.onabort = () => keepsNot(change.error);
  } catch (error) {
    keepsNot(error);
  }
}

// --- files that come and go

function give(name, bytes) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([bytes]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

function pick(endings, several) {
  return new Promise(resolve => {
    const input = document.createElement('input');
    input.type = 'file';
    input.accept = endings;
    input.multiple = several;
    input.oncancel = () => resolve(null);
    input.onchange = async () => {
      const read = async file => [file.name, new Uint8Array(await file.arrayBuffer())];
      resolve(await Promise.all([...input.files].map(read)));
    };
    input.click();
  });
}

// --- threads

function spawn(module, memory, task, name) {
  const worker = new Worker(new URL('worker.js', import.meta.url), { type: 'module', name });
  worker.onmessage = ({ data }) => (data === 'ended' ? worker.terminate() : page_woken());
  worker.onerror = event => console.error(`${name}: ${event.message}`);
  worker.postMessage({ module, memory, task });
}

function stopped(text) {
  document.getElementById('window').remove();
  say(`Sindyscope has stopped by an error of its own (${text}). Reload the page: your work is kept.`);
}

const later = task => setTimeout(() => run_task(task));
const shares = () => self.crossOriginIsolated;

globalThis.sindyscopeHost = { wake: () => setTimeout(page_woken), spawn, later, shares, keep, give, pick, stopped };

async function begin() {
  if (await reloads()) return;
  const keeping = database().then(async opened => [opened, await keptFiles(opened)]).catch(error => [null, [], error]);
  await init();
  const [opened, kept, error] = await keeping;
  base = opened;
  // Not to be thrown away when the disk fills; a browser that will not promise it keeps it all the same, as a rule.
  navigator.storage?.persist?.();
  await open(document.getElementById('window'), kept);
  say('');
  if (error) keepsNot(error);
  // For tests, and for whoever reads the page aloud: what is on it, in words.
  globalThis.sindyscope = { described: () => JSON.parse(described()) };
}

begin().catch(error => {
  console.error(error);
  say(`Sindyscope cannot run in this browser: ${error?.message ?? error}`);
});
