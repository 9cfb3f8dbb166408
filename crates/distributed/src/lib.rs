//! Stokes flow whose cells are shared by ranks.
