//! Exploratory: pairs in shear with and without the film model.
use gluey_geom::{Aabb, Dim, Space, Vector};
use gluey_levelset::Ball;
use gluey_stokes::*;
use gluey_testkit::reference::*;
fn couette<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut u = Vector::<D>::zeros();
    u[0] = x[1] - 0.5;
    u
}
fn st(v: &[f64]) -> (f64, f64, f64) {
    let m = v.iter().sum::<f64>() / v.len() as f64;
    let d = (v.iter().map(|x| (x - m).powi(2)).sum::<f64>() / v.len() as f64).sqrt();
    let w = v.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    (m, d, w)
}
fn shift<const D: usize>(k: u32) -> Vector<D> {
    Vector::from_fn(|d, _| (0.0625 + 0.125 * f64::from((k * [1, 3, 5][d]) % 8)) - 0.5)
}
fn run<const D: usize>(a: f64, level: u8, xi: f64, th: f64, n: u32, exact: (f64, f64, f64), lub: Lubrication)
where
    Dim<D>: Space<D>,
{
    let h = 0.5f64.powi(level.into());
    let (mut e, mut r, mut o, mut its) = (vec![], vec![], vec![], 0);
    for k in 0..n {
        let (sin, cos) = th.to_radians().sin_cos();
        let mut dir = Vector::<D>::zeros();
        dir[0] = cos;
        dir[1] = sin;
        let arm = dir * a * (1.0 + 0.5 * xi);
        let c = Vector::<D>::repeat(0.5) + shift::<D>(k) * h;
        let b = [Ball::new(c - arm, a), Ball::new(c + arm, a)];
        let ev = |k: &str, d: f64| std::env::var(k).map_or(d, |x| x.parse().unwrap());
        let rf = Refinement { coarsest: ev("CO", 3.0) as u8, surface: level, band: ev("BAND", 3.0), gap_fraction: 0.0, gap_levels: 0 };
        let mesh = rf.mesh(Aabb::unit(), [1; D], [false; D], &b).unwrap();
        let p = FlowParams {
            formulation: Formulation::Unfitted { lubrication: lub },
            tolerance: 1e-8,
            ..FlowParams::for_dimension(D)
        };
        match FlowSolver::new(p).unwrap().solve(mesh, &b, &couette) {
            Ok(f) => {
                let line = b[1].center() - b[0].center();
                let nn = line.normalize();
                let rel = f.twists[1].velocity - f.twists[0].velocity;
                its = its.max(f.iteration_count);
                e.push(100.0 * (rel.dot(&nn) / exact.0 - 1.0));
                r.push((nn[0] * rel[1] - nn[1] * rel[0]) / line.norm() - exact.1);
                o.push(f.twists[0].spin[Dim::<D>::ROT - 1] - exact.2);
            }
            Err(x) => println!("{x}"),
        }
    }
    let (e, r, o) = (st(&e), st(&r), st(&o));
    println!(
        "{D}D {lub:?} a/h {:.1} g/h {:.3} xi {xi} th {th}: vn {:+.3} +- {:.3} (worst {:.2}) %  rot {:+.1e} +- {:.1e} spin {:+.1e} +- {:.1e} it {its}",
        a / h, xi * a / h, e.0, e.1, e.2, r.0, r.1, o.0, o.1
    );
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let dim = args[1].as_str();
    let levels: Vec<u8> = args[2].split(',').map(|x| x.parse().unwrap()).collect();
    let gaps: Vec<f64> = args[3].split(',').map(|x| x.parse().unwrap()).collect();
    let n: u32 = args[4].parse().unwrap();
    let lubs: Vec<Lubrication> =
        args[5].chars().map(|c| if c == 'n' { Lubrication::None } else { Lubrication::Deficit }).collect();
    let th: f64 = args.get(6).map_or(135.0, |x| x.parse().unwrap());
    if dim == "2" {
        let table = pair_2d_velocities().unwrap();
        let col = |n: &str| table.column(n).unwrap().to_vec();
        let (xi, ths, vn, rot, om) = (col("xi"), col("theta_deg"), col("vn"), col("rot"), col("omega1"));
        for &level in &levels {
            for &g in &gaps {
                for row in (0..xi.len()).filter(|&r| xi[r] == g && ths[r] == th) {
                    for &l in &lubs {
                        run::<2>(0.05, level, g, th, n, (vn[row], rot[row], om[row]), l);
                    }
                }
            }
        }
    } else {
        let t = Table::parse(
            &std::fs::read_to_string("/work/shared/reference/sphere_pair_mobility_unbounded.csv").unwrap(),
        )
        .unwrap();
        let col = |n: &str| t.column(n).unwrap().to_vec();
        let (xi, ma, mb, c) = (col("xi"), col("one_minus_A"), col("one_minus_B"), col("C_rot"));
        let a = 0.0125;
        for &level in &levels {
            for &g in &gaps {
                let k = (0..xi.len())
                    .min_by(|&i, &j| (xi[i] / g).ln().abs().total_cmp(&(xi[j] / g).ln().abs()))
                    .unwrap();
                let g = xi[k];
                let r = a * (2.0 + g);
                let (s, co) = (2.0 * th.to_radians()).sin_cos();
                // strain 1/2: n.E.n = sin(2th)/2; t.E.n = cos(2th)/2
                let vn = r * ma[k] * 0.5 * s;
                let rot = -0.5 + mb[k] * 0.5 * co;
                let om = -0.5 + c[k] * 0.5 * co;
                for &l in &lubs {
                    run::<3>(a, level, g, th, n, (vn, rot, om), l);
                }
            }
        }
    }
}
