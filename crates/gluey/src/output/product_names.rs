//! Names and signs of what is made of results: tables of particles, pictures, pages for the browser. A run
//! that replaces another one takes them away.

/// Name of a page that is given none.
pub const PAGE_NAME: &str = "view.html";

/// Beginning of every page.
pub const PAGE_HEAD: &[u8] = br#"<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>"#;

/// What gluey draws of a run, by the beginnings of names; those of frames have the number of a step behind.
const PICTURES: [&str; 8] =
    ["gaps", "trajectories", "rheology", "solver", "contacts", "correlations", "profiles", "diffusion"];

/// Whether a text is that of a page, whatever run is in it.
pub(crate) fn is_page(text: &[u8]) -> bool {
    text.starts_with(PAGE_HEAD)
}

/// Whether a file has the name of a table of `gluey analyse`, or of its summary.
pub fn is_table(name: &str) -> bool {
    let tables = [
        "series.csv",
        "g_of_theta.csv",
        "structure_factor.csv",
        "profile_y.csv",
        "diffusion.csv",
        "summary.txt",
    ];
    tables.contains(&name) || (name.starts_with("g_of_r") && name.ends_with(".csv"))
}

/// Whether a file has the name of a picture that `gluey plot` writes.
pub fn is_picture(name: &str) -> bool {
    let Some((stem, "svg" | "png" | "gif")) = name.rsplit_once('.') else { return false };
    let is_step = |text: &str| text.len() >= 6 && text.bytes().all(|byte| byte.is_ascii_digit());
    let is_of_frame = stem
        .rsplit_once('-')
        .is_some_and(|(what, step)| is_step(step) && (what == "particles" || what.starts_with("flow-")));
    PICTURES.contains(&stem) || is_of_frame || name == "particles.gif"
}
