//! Controllers and the plant that their models make together.

/// Steps between two upsets, and from one to the next change of set-points.
pub const BETWEEN: usize = 40;

/// A function that runs the loop of an emitted network from rest at zero: `set` is the size of its set-points, which jump;
/// in between all states are put in a random direction from their references, as far as the i-DPC problem is feasible or,
/// three times out of four, a random share of that way.
///
/// The plant is made of the models in the controllers' tables, so there is no other source for it.
macro_rules! closed_loop {
    ($network:ident: $scalar:ty, $steps:literal steps, set $set:expr;
     $($node:ident { $($other:ident: $link:ident),* })*) => {
        pub fn $network(board: &mut impl $crate::Board) -> $crate::Tally {
            use $crate::closed_loop::BETWEEN;
            use $crate::emitted::$network as own;
            use $crate::process::{Process, place};
            use $crate::random::Random;
            use $crate::scalar::affine;
            use $crate::upset::{edge, moved};

            let mut tally = $crate::Tally::EMPTY;
            $(
                let rest = own::$node::steady_state(&[0.0; own::$node::NETWORK_NY]);
                let Ok((controller, message)) = own::$node::start(&rest) else {
                    tally.refused += 1;
                    return tally;
                };
                let (inbox, set_point) = (own::$node::Inbox::new(), [0.0; own::$node::NY]);
                let mut $node =
                    Process { controller, inbox, message, set_point, x: rest.x, u: rest.u, z: [0.0; own::$node::NZ] };
            )*
            let mut random = Random::new();
            for step in 0..$steps {
                let upset = step % BETWEEN == BETWEEN / 2;
                $($(tally.accepted($node.inbox.accept(&own::$node::$link, &$other.message));)*)*
                $(
                    if upset {
                        let direction: [$scalar; own::$node::NX] = random.direction();
                        let centre = $node.controller.input(&$node.x).telemetry.x_ref;
                        let mut admitted = |distance: $scalar| {
                            let state = moved(&centre, &direction, distance);
                            $node.controller.input(&state).control.is_admissible()
                        };
                        let share: $scalar = if random.seldom() { 1.0 } else { random.share() };
                        $node.x = moved(&centre, &direction, share * edge(&mut admitted));
                    }
                    if step % BETWEEN == 0 {
                        $node.set_point = random.direction().map(|y: $scalar| $set * y);
                    }
                    let before = board.ticks();
                    let answer = $node.controller.step(&$node.x, &$node.set_point, &mut $node.inbox);
                    tally.count(&answer.status, board.since(before));
                    let hash = &mut tally.fingerprint;
                    hash.numbers(&$node.x);
                    hash.numbers(&answer.input);
                    hash.word(answer.message.step.cast_unsigned());
                    hash.numbers(&answer.message.y_ref);
                    hash.numbers(&answer.message.z_ref);
                    hash.word(answer.message.certified.into());
                    $node.message = answer.message;
                    $node.u = answer.input;
                    let model = &own::$node::TABLES.model;
                    $node.z = affine(&model.Dz, &$node.u, affine(&model.Cz, &$node.x, [0.0; own::$node::NZ]));
                )*
                $(
                    let mut imported = [0.0; own::$node::NI];
                    $(place(&mut imported, own::$node::$link.z, &$other.z);)*
                    let model = &own::$node::TABLES.model;
                    let pushed = affine(&model.EL, &imported, [0.0; own::$node::NX]);
                    $node.x = affine(&model.A, &$node.x, affine(&model.B, &$node.u, pushed));
                )*
            }
            $(
                let line = $crate::Line::new().text(stringify!($node)).text(": state");
                let line = $node.x.iter().fold(line, |line, x| line.text(" ").hexadecimal($crate::scalar::Scalar::bits(*x)));
                let line = $node.u.iter().fold(line.text(", input"), |line, u| line.text(" ").hexadecimal($crate::scalar::Scalar::bits(*u)));
                board.print(&line);
            )*
            tally
        }
    };
}

pub(crate) use closed_loop;
