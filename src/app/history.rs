//! Undo and redo.

/// How long a value must rest before it counts as a step of its own, s: a drag or a run of key presses is one step.
const REST: f64 = 0.6;

/// Steps kept.
const DEPTH: usize = 200;

/// What a value was, and what it was before a step was taken back.
#[derive(Clone, Debug)]
pub(crate) struct History<T> {
    past: Vec<T>,
    present: T,
    future: Vec<T>,
    /// The value last seen, and when it last changed.
    seen: T,
    changed: f64,
}

impl<T: Clone + PartialEq> History<T> {
    /// A history that begins here.
    pub(crate) fn new(present: T) -> Self {
        Self { past: Vec::new(), seen: present.clone(), present, future: Vec::new(), changed: 0.0 }
    }

    /// Watches a value, time after time; true once it is a step to be noted: it rests and the pointer does not hold it.
    pub(crate) fn watch(&mut self, value: &T, held: bool, now: f64) -> bool {
        if *value != self.seen {
            self.seen = value.clone();
            self.changed = now;
        }
        !held && now - self.changed >= REST && *value != self.present
    }

    /// Notes a step now, if the value differs from the last one noted.
    pub(crate) fn note(&mut self, value: &T) {
        if *value == self.present {
            return;
        }
        self.past.push(std::mem::replace(&mut self.present, value.clone()));
        if self.past.len() > DEPTH {
            self.past.remove(0);
        }
        self.future.clear();
        self.seen = value.clone();
    }

    /// Puts a value in place of the one that was just set: no step of its own.
    pub(crate) fn replace(&mut self, old: &T, new: &T) {
        for place in [&mut self.present, &mut self.seen] {
            if *place == *old {
                place.clone_from(new);
            }
        }
    }

    /// True if there is a step to take back.
    pub(crate) fn can_undo(&self, value: &T) -> bool {
        !self.past.is_empty() || *value != self.present
    }

    /// True if there is a step to take again.
    pub(crate) fn can_redo(&self, value: &T) -> bool {
        !self.future.is_empty() && *value == self.present
    }

    /// The value before the last step.
    pub(crate) fn undo(&mut self, value: &T) -> Option<T> {
        self.note(value);
        let before = self.past.pop()?;
        self.future.push(std::mem::replace(&mut self.present, before.clone()));
        self.seen = before.clone();
        Some(before)
    }

    /// The value after the step last taken back.
    pub(crate) fn redo(&mut self, value: &T) -> Option<T> {
        self.note(value);
        let after = self.future.pop()?;
        self.past.push(std::mem::replace(&mut self.present, after.clone()));
        self.seen = after.clone();
        Some(after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Watches a value, and notes it when it is a step.
    fn watch(history: &mut History<i32>, value: i32, held: bool, now: f64) {
        if history.watch(&value, held, now) {
            history.note(&value);
        }
    }

    #[test]
    fn a_drag_is_one_step() {
        let mut history = History::new(0);
        for (time, value) in [(1.0, 3), (1.1, 5), (1.2, 8)] {
            watch(&mut history, value, true, time);
        }
        watch(&mut history, 8, true, 5.0);
        assert!(history.can_undo(&8), "what is being dragged can be taken back");
        watch(&mut history, 8, false, 5.1);
        assert_eq!(history.undo(&8), Some(0));
        assert_eq!(history.undo(&0), None);
        assert_eq!(history.redo(&0), Some(8));
        assert!(!history.can_redo(&8));
    }

    #[test]
    fn two_changes_apart_are_two_steps_and_a_new_one_ends_redo() {
        let mut history = History::new(0);
        for (time, value) in [(1.0, 1), (2.0, 1), (3.0, 2), (4.0, 2)] {
            watch(&mut history, value, false, time);
        }
        assert_eq!(history.undo(&2), Some(1));
        watch(&mut history, 7, false, 5.0);
        assert_eq!(history.redo(&7), None);
        assert_eq!(history.undo(&7), Some(1));
        assert_eq!(history.undo(&1), Some(0));
    }
}
