//! What a rank keeps of the flows of a suspension, from step to step and for checkpoints.

use std::cell::RefCell;
use std::sync::Arc;

use gluey_parallel::Ranks;
use gluey_stokes::Suspension;

use crate::warm_start::{KeptFlows, PieceError, SavedPiece};

/// The flows that the next one starts from, as far as they are on this rank, and those that a checkpoint of
/// the step before would have.
pub struct FlowMemory<const D: usize> {
    pub(crate) last: RefCell<Option<Arc<KeptFlows<D>>>>,
    remembered: RefCell<Option<Arc<KeptFlows<D>>>>,
}

impl<const D: usize> Default for FlowMemory<D> {
    fn default() -> Self {
        Self { last: RefCell::default(), remembered: RefCell::default() }
    }
}

impl<const D: usize> FlowMemory<D> {
    /// Keeps what the next flow starts from for a checkpoint.
    pub(crate) fn remember(&self) {
        self.remembered.replace(self.last.borrow().clone());
    }

    /// What a checkpoint is to have of this rank; nothing before the first flow. All ranks have something or
    /// none has.
    pub fn saved(&self) -> Vec<SavedPiece> {
        self.remembered.borrow().as_ref().map_or(Vec::new(), |kept| kept.saved())
    }

    /// Goes on from pieces of a checkpoint: those that [`SavedPiece::holder`] gives to this rank, or where
    /// there are none any other.
    ///
    /// # Errors
    /// [`PieceError`] for pieces that do not belong to the suspension; nothing has changed then.
    pub fn restore(
        &self,
        suspension: &Suspension<D>,
        ranks: &Ranks,
        saved: Vec<SavedPiece>,
    ) -> Result<(), PieceError> {
        let restored = KeptFlows::restored(suspension, ranks, saved)?;
        self.last.replace(Some(Arc::new(restored)));
        Ok(())
    }
}
