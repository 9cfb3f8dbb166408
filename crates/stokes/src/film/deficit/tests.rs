use super::*;

/// A number that belongs to a thickness.
type Functional<'a> = dyn Fn(&dyn Fn(f64) -> f64) -> f64 + 'a;

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
        let lacks = |of: &Functional<'_>| {
            let [film, seen] = profiles(shape);
            of(&film) - of(&seen)
        };
        let plain = lacks(&|h| integral(|x| 1.0 / h(x)));
        let normal = lacks(&|h| 12.0 * integral(|x| x * x / h(x).powi(3)));
        let normal = normal + 3.0 * 1.725 * 0.5 * plain;
        for (found, exact) in [(found.sliding, plain), (found.normal, normal)] {
            assert!((found / exact - 1.0).abs() < 1e-4, "{gap} {height}: {found} {exact}");
        }
        let edge = (shape.radius * (height - gap)).sqrt();
        for (w, m) in [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.5)] {
            let power = |h: &dyn Fn(f64) -> f64, flat: f64| {
                let force = |x: f64| {
                    let inside = x.abs().min(flat);
                    0.5 * (w * inside * inside + m * (x * x - inside * inside))
                };
                let moment = |k: i32| integral(|x| force(x).powi(k) / h(x).powi(3));
                12.0 * (moment(2) - moment(1).powi(2) / moment(0))
            };
            let [film, seen] = profiles(shape);
            let exact = power(&film, 0.0) - power(&seen, edge);
            let [ww, wm, mm] = found.rolling;
            let lacks = ww * w * w + 2.0 * wm * w * m + mm * m * m;
            assert!((lacks - exact).abs() < 1e-4 * mm, "{gap} {height} {w} {m}: {lacks} {exact}");
        }
    }
}

/// The power of Reynolds' equation in a film around an axis for `f = w` up to `edge` and `m` beyond, by
/// finite volumes for `p = u(r) x / r` between circles whose radii grow by a factor.
fn power(h: impl Fn(f64) -> f64, edge: f64, [w, m]: [f64; 2]) -> f64 {
    let count = 6000;
    let radius = |k: f64| edge * (1e-3f64).powf(1.0 - 2.0 * k / count as f64);
    let (mut ratio, mut sum) = (vec![0.0; count + 1], vec![0.0; count + 1]);
    let f = |r: f64| if r < edge { w } else { m };
    // Gauss elimination from the middle outwards: u_k = ratio_k u_(k+1) + sum_k.
    for k in 0..count {
        let (r, inner, outer) = (radius(k as f64), radius(k as f64 - 0.5), radius(k as f64 + 0.5));
        let flux = |at: f64, from: f64, to: f64| at * h(at).powi(3) / (to - from);
        let [left, right] = [flux(inner, radius(k as f64 - 1.0), r), flux(outer, r, radius(k as f64 + 1.0))];
        let width = outer - inner;
        let own = left + right + h(r).powi(3) / r * width;
        let load = -12.0 * f(r) * r * r * width;
        // In the middle u grows like r.
        let (before, known) = if k == 0 { (radius(-1.0) / r, 0.0) } else { (ratio[k - 1], sum[k - 1]) };
        let pivot = own - left * before;
        ratio[k] = right / pivot;
        sum[k] = (load + left * known) / pivot;
    }
    let (mut u, mut power) = (0.0, 0.0);
    for k in (0..count).rev() {
        u = ratio[k] * u + sum[k];
        let r = radius(k as f64);
        power -= PI * f(r) * u * r * r * (radius(k as f64 + 0.5) - radius(k as f64 - 0.5));
    }
    power
}

#[test]
fn spheres_lack_what_reynolds_equation_says_of_rolling() {
    for (gap, height) in [(1e-3, 0.1), (0.02, 0.1), (0.06, 0.1)] {
        let shape = shape(gap, height);
        let [ww, wm, mm] = shape.deficits::<3>().rolling;
        let edge = (shape.radius * (height - gap)).sqrt();
        let [film, seen] = profiles(shape);
        for [w, m] in [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.5]] {
            let exact = power(&film, edge, [m, m]) - power(&seen, edge, [w, m]);
            let lacks = ww * w * w + 2.0 * wm * w * m + mm * m * m;
            assert!((lacks - exact).abs() < 5e-3 * mm, "{gap} {height} {w} {m}: {lacks} {exact}");
        }
    }
}

#[test]
fn spheres_lack_what_lubrication_theory_integrates() {
    for (gap, height) in [(1e-3, 0.1), (0.02, 0.1), (0.08, 0.1), (1e-4, 0.3)] {
        let shape = shape(gap, height);
        let found = shape.deficits::<3>();
        let lacks = |of: &Functional<'_>| {
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
        assert!(
            found
                .iter()
                .flat_map(|d| [d.normal, d.sliding].into_iter().chain(d.rolling))
                .all(|d| d.abs() < 1e-6)
        );
    }
}

#[test]
fn discs_lack_what_the_flow_through_their_film_needs() {
    for (gap, height) in [(1e-3, 0.1), (0.02, 0.1), (0.08, 0.1), (0.0999, 0.1), (1e-4, 0.3)] {
        let shape = shape(gap, height);
        let found = shape.deficits_with_flow::<2>();
        let [film, _] = profiles(shape);
        let edge = shape.edge();
        // x = scale sinh(u), which crowds points in the middle.
        let scale = (shape.radius * gap).sqrt();
        let end = (edge / scale).asinh();
        let inside = |f: &dyn Fn(f64) -> f64| -> f64 {
            let term = |(s, weight): (f64, f64)| {
                let u = (2.0 * s - 1.0) * end;
                2.0 * end * weight * scale * u.cosh() * f(scale * u.sinh())
            };
            gauss(200).into_iter().map(term).sum()
        };
        let square = |x: f64| (x / shape.radius).powi(2);
        let bend = |x: f64| 0.75 * square(x) * square(x) * shape.radius;
        let beyond = 12.0 * inside(&|x| 1.2 * square(x) / film(x).powi(3) - bend(x) / film(x).powi(4));
        for (q, m) in [(1.0, 0.0), (0.0, 1.0), (1.0, -3.0)] {
            let flow = |x: f64| q + 0.5 * m * (edge * edge - x * x);
            let whole = 12.0 * inside(&|x| flow(x).powi(2) * (film(x).powi(-3) - height.powi(-3)));
            let free = q + found.carried * m;
            let exact = whole + beyond * free * free;
            let lacks = found.through * free * free + found.rolling.iter().sum::<f64>() * m * m;
            let scale = found.through * q * q + found.rolling[2] * m * m;
            assert!((lacks - exact).abs() < 1e-6 * scale, "{gap} {height} {q} {m}: {lacks} {exact}");
        }
    }
}

/// The power of Reynolds' equation within the edge for `f = m` and the flow `q` through the edge, by finite
/// volumes as in [`power`].
fn power_within(h: impl Fn(f64) -> f64, edge: f64, [q, m]: [f64; 2]) -> f64 {
    let count = 6000;
    let radius = |k: f64| edge * (1e-3f64).powf(1.0 - k / count as f64);
    let (mut ratio, mut sum) = (vec![0.0; count], vec![0.0; count]);
    for k in 0..count {
        let [inner, r, outer] = [0.0, 0.5, 1.0].map(|part| radius(k as f64 + part));
        let flux = |at: f64, from: f64, to: f64| at * h(at).powi(3) / (to - from);
        let left = flux(inner, radius(k as f64 - 0.5), r);
        let is_last = k + 1 == count;
        let right = if is_last { 0.0 } else { flux(outer, r, radius(k as f64 + 1.5)) };
        let width = outer - inner;
        let own = left + right + h(r).powi(3) / r * width;
        let load = -12.0 * (m * r * r * width + if is_last { q * edge } else { 0.0 });
        let (before, known) = if k == 0 { (radius(-0.5) / r, 0.0) } else { (ratio[k - 1], sum[k - 1]) };
        let pivot = own - left * before;
        ratio[k] = right / pivot;
        sum[k] = (load + left * known) / pivot;
    }
    let (mut u, mut power) = (0.0, 0.0);
    for k in (0..count).rev() {
        u = ratio[k] * u + sum[k];
        let r = radius(k as f64 + 0.5);
        if k + 1 == count {
            power -= PI * edge * q * (u - 12.0 * q / h(edge).powi(3) * (edge - r));
        }
        power -= PI * m * u * r * r * (radius(k as f64 + 1.0) - radius(k as f64));
    }
    power
}

#[test]
fn spheres_lack_what_the_flow_through_their_film_needs() {
    for (gap, height) in [(1e-3, 0.1), (0.02, 0.1), (0.09, 0.1), (1e-6, 0.1)] {
        let shape = shape(gap, height);
        let found = shape.deficits_with_flow::<3>();
        let edge = shape.edge();
        let [film, _] = profiles(shape);
        for (q, m) in [(1.0, 0.0), (0.0, 1.0), (1.0, -3.0)] {
            let exact = power_within(&film, edge, [q, m]) - power_within(|_| height, edge, [q, m]);
            let free = q + found.carried * m;
            let lacks = found.through * free * free + found.rolling.iter().sum::<f64>() * m * m;
            let scale = found.through * q * q + found.rolling[2] * m * m;
            assert!((lacks - exact).abs() < 5e-3 * scale, "{gap} {height} {q} {m}: {lacks} {exact}");
        }
    }
}
