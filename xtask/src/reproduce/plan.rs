//! Which runs a figure needs, and in what order they go.

use std::fmt;

use anyhow::anyhow;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// The cases of the paper, as named in `data/cases`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum CaseName {
    /// Two discs that nearly touch (paper, figures 5 and 6).
    #[value(name = "pair-2d")]
    Pair2d,
    /// Two spheres that meet (figure 7).
    #[value(name = "pair-3d")]
    Pair3d,
    /// The pair of discs and a third one (figures 9 to 11).
    #[value(name = "trio-2d")]
    Trio2d,
}

/// The name of one of a few things.
fn name(thing: &impl ValueEnum) -> String {
    thing.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

impl fmt::Display for CaseName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&name(self))
    }
}

/// The ways each case is computed: the paper's three strategies in its formulation, its gluey contact as
/// printed, and the accurate formulation, in which lubrication keeps particles apart and no contact acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Approach {
    /// No contact model, formulation `paper`.
    None,
    /// Inelastic collisions, formulation `paper`.
    Inelastic,
    /// Gluey contact, formulation `paper`.
    Gluey,
    /// Gluey contact to the letter of the paper: constraint of first order, memory in whole steps, velocity
    /// of a particle at its centre; formulation `paper`.
    GlueyAsPrinted,
    /// The same with twice the time step, to see what the time step does; in tables only.
    GlueyAsPrintedLargeStep,
    /// No contact model, formulation `unfitted` with lubrication, in the box of the exact solution.
    Unfitted,
    /// The same in the box of the paper's runs, where that is another one: three discs.
    UnfittedPeriodic,
}

/// A run: a case and the way it is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RunKey {
    /// The case.
    pub case: CaseName,
    /// The way it is computed.
    pub approach: Approach,
}

impl RunKey {
    /// Name of the run's CSV file without its extension.
    pub fn name(self) -> String {
        format!("{}-{}", self.case, name(&self.approach))
    }

    /// Every case in every way.
    pub fn all() -> impl Iterator<Item = Self> {
        let of_case = |&case| Approach::value_variants().iter().map(move |&approach| Self { case, approach });
        CaseName::value_variants().iter().flat_map(of_case)
    }

    /// Time up to which this run is that of other strategies, since no particles touch in any of them; none
    /// where they touch from the first step on, or where the flow or the time step is another one.
    pub fn common_end(self) -> Option<f64> {
        let is_common = matches!(self.approach, Approach::None | Approach::Inelastic | Approach::Gluey);
        (self.case == CaseName::Pair3d && is_common).then_some(7.5)
    }

    /// Seconds that the run takes, about; only the order of the runs depends on it. The first of those with a
    /// common beginning makes that too, and none of the others follows at once, to wait for it.
    fn cost(self) -> u32 {
        match (self.case, self.approach) {
            (CaseName::Pair3d, Approach::None) => 110,
            (CaseName::Pair3d, Approach::GlueyAsPrinted) => 105,
            (CaseName::Pair3d, Approach::Unfitted) => 95,
            (CaseName::Pair3d, _) => 60,
            (CaseName::Trio2d, Approach::Unfitted) => 15,
            (CaseName::Trio2d, Approach::UnfittedPeriodic) => 40,
            (CaseName::Trio2d, _) => 55,
            (CaseName::Pair2d, Approach::GlueyAsPrintedLargeStep) => 20,
            (CaseName::Pair2d, _) => 35,
        }
    }
}

impl fmt::Display for RunKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name())
    }
}

/// The figures of the paper that show its results and set-ups.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FigureName {
    /// Gluey contact as the limit of lubrication (section 2.5, which has no figure).
    Limit,
    /// Set-up with two particles.
    Fig4,
    /// 2D pair, gap over time.
    Fig5,
    /// 2D pair, trajectories.
    Fig6,
    /// 3D pair, gap over time.
    Fig7a,
    /// 3D pair, trajectories.
    Fig7b,
    /// Set-up with three particles.
    Fig8,
    /// Three discs, gaps over time.
    Fig9,
    /// Three discs, trajectories: gluey and none.
    Fig10,
    /// Three discs, trajectories: gluey and inelastic.
    Fig11,
}

impl FigureName {
    /// All of them, in the paper's order.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::value_variants().iter().copied()
    }

    /// The figure of this name.
    pub fn named(name: &str) -> anyhow::Result<Self> {
        let figures: Vec<String> = Self::all().map(|figure| figure.to_string()).collect();
        let unknown = || anyhow!("there is no figure `{name}`; the figures are {}", figures.join(", "));
        Self::all().zip(&figures).find(|(_, own)| *own == name).map(|(figure, _)| figure).ok_or_else(unknown)
    }

    /// The case whose set-up or runs it shows.
    pub fn case(self) -> CaseName {
        match self {
            Self::Limit | Self::Fig4 | Self::Fig5 | Self::Fig6 => CaseName::Pair2d,
            Self::Fig7a | Self::Fig7b => CaseName::Pair3d,
            Self::Fig8 | Self::Fig9 | Self::Fig10 | Self::Fig11 => CaseName::Trio2d,
        }
    }

    /// The ways of computing its case that it shows, in the order of its legend.
    pub fn approaches(self) -> Vec<Approach> {
        use Approach::{Gluey, GlueyAsPrinted, Inelastic, None, Unfitted, UnfittedPeriodic};
        match self {
            Self::Limit | Self::Fig4 | Self::Fig8 => Vec::new(),
            Self::Fig5 | Self::Fig6 | Self::Fig7a | Self::Fig7b => {
                vec![Gluey, GlueyAsPrinted, Inelastic, None, Unfitted]
            }
            Self::Fig9 => vec![Gluey, Inelastic, None, UnfittedPeriodic, Unfitted],
            Self::Fig10 => vec![Gluey, None, Unfitted],
            Self::Fig11 => vec![Gluey, Inelastic, Unfitted],
        }
    }

    /// The runs behind its drawing and its tables.
    pub fn runs(self) -> Vec<RunKey> {
        let key = |case: CaseName| move |approach| RunKey { case, approach };
        let mut runs: Vec<RunKey> = self.approaches().into_iter().map(key(self.case())).collect();
        match self {
            Self::Fig5 | Self::Fig7a => runs.push(key(self.case())(Approach::GlueyAsPrintedLargeStep)),
            // How much three discs differ is told beside how much two do.
            Self::Fig10 => runs.extend([Approach::Gluey, Approach::None].map(key(CaseName::Pair2d))),
            _ => {}
        }
        runs
    }
}

impl fmt::Display for FigureName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&name(self))
    }
}

/// The runs these figures need, each once, the longest first.
pub fn runs_for(figures: &[FigureName], quick: bool) -> Vec<RunKey> {
    let mut runs: Vec<RunKey> = figures.iter().flat_map(|figure| figure.runs()).collect();
    runs.retain(|&run| !quick || run != ONLY_IN_FULL);
    runs.sort();
    runs.dedup();
    runs.sort_by_key(|run| std::cmp::Reverse(run.cost()));
    runs
}

/// The run that `--quick` does without: at its time step, twice that would be four times the paper's, which
/// says nothing about smaller ones.
const ONLY_IN_FULL: RunKey = RunKey { case: CaseName::Pair3d, approach: Approach::GlueyAsPrintedLargeStep };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_figures_need_seventeen_runs_and_the_spheres_go_first() {
        let runs = runs_for(FigureName::value_variants(), false);
        assert_eq!(runs.len(), 17);
        assert_eq!(runs_for(FigureName::value_variants(), true).len(), 16);
        assert!(runs[..6].iter().all(|run| run.case == CaseName::Pair3d));
        // Two at a time do not wait for each other.
        assert!(runs[0].common_end().is_some() && runs[1..3].iter().all(|run| run.common_end().is_none()));
    }

    #[test]
    fn a_single_figure_makes_only_its_own_runs() {
        let names: Vec<String> = runs_for(&[FigureName::Fig11], true).iter().map(|run| run.name()).collect();
        assert_eq!(names, ["trio-2d-inelastic", "trio-2d-gluey", "trio-2d-unfitted"]);
        assert!(runs_for(&[FigureName::Fig4, FigureName::Fig8], false).is_empty());
    }

    #[test]
    fn figure_names_are_read_back_and_others_refused() {
        for figure in FigureName::all() {
            assert_eq!(FigureName::named(&figure.to_string()).ok(), Some(figure));
        }
        let error = FigureName::named("fig7").unwrap_err().to_string();
        assert!(
            error
                .ends_with("the figures are limit, fig4, fig5, fig6, fig7a, fig7b, fig8, fig9, fig10, fig11")
        );
    }
}
