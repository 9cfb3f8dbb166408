//! A case with what it leaves to defaults written down.

use super::Case;

impl Case {
    /// This case with all defaults that follow from others stated: corners of the box, the tree of the mesh,
    /// what acts in films. It runs bit for bit as this one does.
    pub fn filled(&self) -> Self {
        let mut case = self.clone();
        case.domain.lower = Some(self.lower());
        case.domain.upper = Some(self.upper());
        case.rheology = self.has_rheology().then(|| self.rheology.clone().unwrap_or_default());
        case.flow.lubrication = Some(self.lubrication());
        case.flow.mesh.cells_per_radius = Some(self.cells_per_radius());
        case.flow.mesh.root_cells = self.root_cells().and_then(|roots| roots.into_iter().min());
        case.flow.mesh.coarsest_level = Some(self.coarsest_level());
        case
    }

    /// The text of a case file that alone suffices to run this case: defaults are stated, particles listed.
    ///
    /// # Errors
    /// When a value has no form in TOML, which no checked case has.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(&self.filled())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_filled_in_is_a_valid_case_and_stays_as_it_is() {
        let sources = [
            include_str!("../../../../data/cases/pair-2d.toml"),
            include_str!("../../../../data/cases/pair-3d-mobility.toml"),
            include_str!("../../../../data/cases/suspension-2d.toml"),
            include_str!("../../../../data/cases/sedimentation-2d.toml"),
        ];
        for text in sources {
            let case = Case::parse(text, "case.toml").expect("a good case");
            let written = case.to_toml().expect("text");
            let read = Case::parse(&written, "written.toml").unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(read.particles, case.particles, "{}", case.name);
            assert_eq!(read.to_toml().expect("text"), written);
            assert!(written.contains("cells_per_radius") && written.contains("lubrication"), "{written}");
        }
    }
}
