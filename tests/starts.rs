use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_tests::read;
use nalgebra::DVector;
use std::path::Path;

#[test]
fn smoke() {
    let source = read(Path::new("../examples/four_tank/system.toml"));
    let text = source.text.replace("horizon = 3 ", "start-anywhere = true\nhorizon = 3 ");
    let design = Design::new(Source { text, ..source }).unwrap();
    for x in [
        [-12.4, -1.4, -12.7, -1.8],
        [0.0, 0.0, 0.0, 0.0],
        [5.0, 1.0, -2.0, 1.0],
        [-12.0, -1.3, -12.0, -1.7],
        [27.0, 38.0, 27.0, 38.0],
        [10.0, 0.0, -10.0, 0.0],
        [27.6, 38.6, 27.3, 38.2],
        [27.6, 38.6, 0.0, 0.0],
        [-12.4, -1.2, 0.0, 0.0],
    ] {
        let x0 = [DVector::from_row_slice(&x[..2]), DVector::from_row_slice(&x[2..])];
        let t = std::time::Instant::now();
        match design.plan(&x0) {
            Ok(plan) => println!(
                "{x:?}: {} steps, margin {:.2e}, end {:?}, dx {:?} {:?}, off {:?} {:?} ms",
                plan.steps,
                plan.margin,
                plan.subsystems.iter().map(|s| s.x.last().unwrap()[0]).collect::<Vec<_>>(),
                plan.subsystems[0].dx.as_slice(),
                plan.subsystems[1].dx.as_slice(),
                (&x0[0] - &plan.subsystems[0].x[0]).as_slice().to_vec(),
                t.elapsed().as_millis()
            ),
            Err(why) => println!("{x:?}: {why} {:?} ms", t.elapsed().as_millis()),
        }
    }
}
