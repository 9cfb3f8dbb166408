//! Orders of rank zero to the others between two flows.

use gluey_parallel::{Communicator, Ranks};

/// A frame with the fields of the last flow that rank zero wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameName {
    /// Which of several streams of frames it belongs to.
    pub stream: u32,
    /// Its step.
    pub step: u32,
}

/// An order of rank zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Order {
    End,
    Predict,
    Show(FrameName),
    Remember,
    Keep(u64),
    Contact,
}

impl Order {
    /// What rank zero wants, on all ranks.
    pub fn share(self, ranks: &Ranks) -> Self {
        let mut numbers = match self {
            Self::End => [0.0; 3],
            Self::Predict => [1.0, 0.0, 0.0],
            Self::Show(FrameName { stream, step }) => [2.0, f64::from(stream), f64::from(step)],
            Self::Remember => [3.0, 0.0, 0.0],
            Self::Contact => [5.0, 0.0, 0.0],
            Self::Keep(name) => [4.0, (name >> 32) as f64, (name & u64::from(u32::MAX)) as f64],
        };
        ranks.share(&mut numbers);
        let [order, first, second] = numbers.map(|number| number as u32);
        match order {
            0 => Self::End,
            1 => Self::Predict,
            2 => Self::Show(FrameName { stream: first, step: second }),
            3 => Self::Remember,
            5 => Self::Contact,
            _ => Self::Keep(u64::from(first) << 32 | u64::from(second)),
        }
    }
}

/// For rank zero between two flows: has the others, who
/// [`SharedSuspension::follow_and_show`](crate::SharedSuspension::follow_and_show), show the fields of the
/// last one.
pub fn ask_for_fields(ranks: &Ranks, frame: FrameName) {
    Order::Show(frame).share(ranks);
}

/// For rank zero between two flows: has the others keep, under a name, what the flow after the step that was
/// checkpointed last starts from.
pub fn ask_to_keep(ranks: &Ranks, name: u64) {
    Order::Keep(name).share(ranks);
}
