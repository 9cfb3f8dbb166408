use super::*;

/// Trapezoidal rule on `[-1e3, 1e3]` in a variable that crowds points in the middle.
fn integral(f: impl Fn(f64) -> f64) -> f64 {
    let count = 400_000;
    let (lower, step) = (-12.0, 24.0 / count as f64);
    let term = |k: usize| {
        let s: f64 = lower + k as f64 * step;
        // x = sinh(s) / 100.
        f(s.sinh() / 100.0) * s.cosh() / 100.0 * step
    };
    (0..=count).map(term).sum()
}

fn shape(gap: f64, height: f64) -> FilmShape {
    FilmShape { gap, height, radius: 0.7, logarithm: 0.0 }
}

/// The thickness of a film, and what the mesh sees.
fn profiles(shape: FilmShape) -> [impl Fn(f64) -> f64; 2] {
    [0.0, shape.height].map(move |least| move |x: f64| least.max(shape.gap + x * x / shape.radius))
}

#[test]
fn discs_lack_what_lubrication_theory_integrates() {
    for (gap, height) in [(1e-3, 0.1), (0.02, 0.1), (0.08, 0.1), (1e-4, 0.3)] {
        let shape = shape(gap, height);
        let found = shape.deficits::<2>();
        let lacks = |of: &dyn Fn(&dyn Fn(f64) -> f64) -> f64| {
            let [film, seen] = profiles(shape);
            of(&film) - of(&seen)
        };
        let plain = lacks(&|h| integral(|x| 1.0 / h(x)));
        let normal = lacks(&|h| 12.0 * integral(|x| x * x / h(x).powi(3)));
        let rolling = lacks(&|h| {
            let [i, j, k] = [1, 2, 3].map(|power| integral(|x| h(x).powi(-power)));
            3.0 * shape.radius.powi(2) * (i - j * j / k)
        });
        let normal = normal + 3.0 * 1.725 * 0.5 * plain;
        for (found, exact) in [(found.sliding, plain), (found.normal, normal), (found.rolling, rolling)] {
            assert!((found / exact - 1.0).abs() < 1e-4, "{gap} {height}: {found} {exact}");
        }
    }
}

#[test]
fn spheres_lack_what_lubrication_theory_integrates() {
    for (gap, height) in [(1e-3, 0.1), (0.02, 0.1), (0.08, 0.1), (1e-4, 0.3)] {
        let shape = shape(gap, height);
        let found = shape.deficits::<3>();
        let lacks = |of: &dyn Fn(&dyn Fn(f64) -> f64) -> f64| {
            let [film, seen] = profiles(shape);
            of(&film) - of(&seen)
        };
        // Half of what runs over all x.
        let normal = lacks(&|h| 3.0 * PI * integral(|x| x.abs().powi(3) / h(x).powi(3)));
        // Both integrals grow with the logarithm of the end: the difference does not.
        let [film, seen] = profiles(shape);
        let sliding = PI * integral(|x| x.abs() * (1.0 / film(x) - 1.0 / seen(x)));
        for (found, exact) in [(found.normal, normal), (found.sliding, sliding)] {
            assert!((found / exact - 1.0).abs() < 1e-4, "{gap} {height}: {found} {exact}");
        }
    }
}

#[test]
fn nothing_is_lacking_from_the_height_on() {
    for gap in [0.1, 0.1 - 1e-9, 0.2] {
        let found = [shape(gap, 0.1).deficits::<2>(), shape(gap, 0.1).deficits::<3>()];
        assert!(found.iter().flat_map(|d| [d.normal, d.sliding, d.rolling]).all(|d| d.abs() < 1e-6));
    }
}
