//! Where things were before: undo and redo of moves.

use std::sync::Arc;

use crate::geometry::Similarity;

type Places = Arc<Vec<Similarity>>;

/// Moves that can be undone are kept up to this many.
const MOST: usize = 200;

/// See the module.
#[derive(Default)]
pub(super) struct Moves {
    undone: Vec<Places>,
    done: Vec<Places>,
    /// Before the move under way.
    before: Option<Places>,
}

impl Moves {
    /// Another scene.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Something is moved from `places`; many small steps are one move.
    pub(super) fn begin(&mut self, places: &Places) {
        self.before.get_or_insert_with(|| Arc::clone(places));
    }

    /// It was let go of.
    pub(super) fn end(&mut self, places: &Places) {
        let Some(before) = self.before.take().filter(|before| before != places) else { return };
        self.done.push(before);
        if self.done.len() > MOST {
            self.done.remove(0);
        }
        self.undone.clear();
    }

    /// Takes the last move back; whether there was one.
    pub(super) fn undo(&mut self, places: &mut Places) -> bool {
        self.end(places);
        step(&mut self.done, &mut self.undone, places)
    }

    /// Makes it again.
    pub(super) fn redo(&mut self, places: &mut Places) -> bool {
        self.end(places);
        step(&mut self.undone, &mut self.done, places)
    }
}

fn step(from: &mut Vec<Places>, to: &mut Vec<Places>, places: &mut Places) -> bool {
    let Some(other) = from.pop() else { return false };
    to.push(std::mem::replace(places, other));
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(scale: f64) -> Places {
        Arc::new(vec![Similarity { scale, ..Similarity::IDENTITY }])
    }

    #[test]
    fn moves_are_undone_one_by_one_and_made_again() {
        let (mut moves, mut now) = (Moves::default(), at(1.0));
        assert!(!moves.undo(&mut now) && !moves.redo(&mut now));
        for scale in [2.0, 3.0] {
            // Two steps of one move.
            moves.begin(&now);
            now = at(scale - 0.5);
            moves.begin(&now);
            now = at(scale);
            moves.end(&now);
            // Nothing was moved.
            moves.begin(&now);
            moves.end(&now);
        }
        assert!(moves.undo(&mut now));
        assert_eq!(now, at(2.0));
        assert!(moves.undo(&mut now));
        assert_eq!(now, at(1.0));
        assert!(!moves.undo(&mut now));
        assert!(moves.redo(&mut now));
        assert_eq!(now, at(2.0));
        // A new move makes what was undone go.
        moves.begin(&now);
        now = at(7.0);
        assert!(moves.undo(&mut now), "also of a move that is under way");
        assert_eq!(now, at(2.0));
        assert!(moves.redo(&mut now) && !moves.redo(&mut now));
        assert_eq!(now, at(7.0));
    }
}
