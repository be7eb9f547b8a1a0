//! Controllers of three shapes, as emitted code would make them.
#![no_std]
#![forbid(unsafe_code)]

use dpc_runtime::tables::{Clamp, Nearest};
use dpc_runtime::{Controller, Inbox, Link, Message, Refused, Sender, StartError, StartPlan, SteadyState, Step, Tables};

pub mod planar;

pub mod four_tank {
    use super::*;

    type Layer = Clamp<1, 0>;
    type Node<'a> = Controller<'a, Layer, 2, 1, 1, 1, 1, 0, 0, 1, 3, 5, 21, 4, 6, 6>;

    pub fn start<'a>(
        tables: &'a Tables<Layer, 2, 1, 1, 1, 1, 0, 0, 1, 3, 5, 21, 4, 6, 6>,
        steady: &SteadyState<2, 1>,
    ) -> Result<(Node<'a>, Message<1, 1>), StartError> {
        Controller::start(tables, steady)
    }

    pub fn start_planned<'a>(
        tables: &'a Tables<Layer, 2, 1, 1, 1, 1, 0, 0, 1, 3, 5, 21, 4, 6, 6>,
        plan: &'a StartPlan<'a, 2, 1, 1, 3>,
        x: &[f64; 2],
    ) -> Result<(Node<'a>, Message<1, 1>), StartError> {
        Controller::start_planned(tables, plan, None, x)
    }

    pub fn accept(inbox: &mut Inbox<1, 0, 1>, link: &Link<1, 1>, message: &Message<1, 1>) -> Result<(), Refused> {
        inbox.accept(link, message)
    }

    pub fn accept_bytes(inbox: &mut Inbox<1, 0, 1>, link: &Link<1, 1>, bytes: &[u8]) -> Result<(), Refused> {
        inbox.accept_bytes(link, bytes)
    }

    pub fn to_bytes(message: &Message<1, 1>, sender: &Sender) -> [u8; 48] {
        message.to_bytes(sender)
    }

    pub fn place_in(bytes: &[u8]) -> Result<u32, Refused> {
        Sender::place_in(bytes)
    }

    pub fn step(
        node: &mut Node<'_>,
        x: &[f64; 2],
        set_point: &[f64; 1],
        inbox: &mut Inbox<1, 0, 1>,
    ) -> Step<2, 1, 1, 1, 1> {
        node.step(x, set_point, inbox)
    }
}

pub mod robots {
    use super::*;

    type Layer = Nearest<2, 8, 0, 2>;
    type Node<'a> = Controller<'a, Layer, 4, 2, 2, 2, 4, 4, 2, 2, 5, 14, 60, 8, 20, 20>;

    pub fn start<'a>(
        tables: &'a Tables<Layer, 4, 2, 2, 2, 4, 4, 2, 2, 5, 14, 60, 8, 20, 20>,
        steady: &SteadyState<4, 2>,
    ) -> Result<(Node<'a>, Message<2, 2>), StartError> {
        Controller::start(tables, steady)
    }

    pub fn accept(inbox: &mut Inbox<4, 4, 2>, link: &Link<2, 2>, message: &Message<2, 2>) -> Result<(), Refused> {
        inbox.accept(link, message)
    }

    pub fn step(
        node: &mut Node<'_>,
        x: &[f64; 4],
        set_point: &[f64; 2],
        inbox: &mut Inbox<4, 4, 2>,
    ) -> Step<4, 2, 2, 2, 2> {
        node.step(x, set_point, inbox)
    }
}

/// Robots whose dynamics nothing couples, with a row for every pair.
pub mod changing {
    use super::*;
    use dpc_runtime::{HalfSpace, NotRedrawn};

    type Layer = Nearest<2, 4, 0, 0>;
    type Node<'a> = Controller<'a, Layer, 4, 2, 2, 2, 0, 4, 0, 2, 3, 10, 28, 6, 6, 6, 2>;

    pub fn start<'a>(
        tables: &'a Tables<Layer, 4, 2, 2, 2, 0, 4, 0, 2, 3, 10, 28, 6, 6, 6, 2>,
        steady: &SteadyState<4, 2>,
    ) -> Result<(Node<'a>, Message<2, 2>), StartError> {
        Controller::start(tables, steady)
    }

    /// Along the way between the two.
    pub fn redraw(node: &mut Node<'_>, row: usize, inbox: &Inbox<0, 4, 2>) -> Result<(), NotRedrawn> {
        node.redraw(row, inbox, |meeting| {
            let pair = meeting.pair()?;
            let [[x, y], [z, w]] = [pair.first, pair.second];
            let drawn: HalfSpace<2, 4> = pair.apart(&[x - z, y - w], 1.0);
            meeting.admits(&drawn).then_some(drawn)
        })
    }

    pub fn step(
        node: &mut Node<'_>,
        x: &[f64; 4],
        set_point: &[f64; 2],
        inbox: &mut Inbox<0, 4, 2>,
    ) -> Step<4, 2, 2, 2, 2> {
        node.step(x, set_point, inbox)
    }
}
