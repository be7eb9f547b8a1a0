//! Is what a controller reads from bytes what its neighbour wrote, and nothing else?

use crate::pair::{self, OTHER, PairController, PairInbox, PairMessage, SENDER};
use crate::random::Random;
use dpc_runtime::{Delivery, HEADER_BYTES, Link, Message, Refused, Sender, SteadyState, single};

const BYTES: usize = PairMessage::BYTES;

fn message(step: i64) -> PairMessage {
    Message { step, y_ref: [-1.5], z_ref: [f64::MIN_POSITIVE], certified: true, plan: 0x0a0b_0c0d }
}

fn bytes(step: i64) -> [u8; BYTES] {
    message(step).to_bytes(&SENDER)
}

/// As the table in the crate's documentation has it.
#[test]
fn the_layout_is_fixed() {
    let message = PairMessage { z_ref: [2.0], ..message(-2) };
    let written: [u8; BYTES] = message.to_bytes(&SENDER);
    let mut expected = vec![1, 8, 1, 0, 1, 0, 0, 0, 0xef, 0xcd, 0xab, 0x89, 0x67, 0x45, 0x23, 0x01];
    expected.extend([0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x0d, 0x0c, 0x0b, 0x0a, 1, 0, 1, 0]);
    expected.extend([0, 0, 0, 0, 0, 0, 0xf8, 0xbf, 0, 0, 0, 0, 0, 0, 0, 0x40]);
    assert_eq!(written.to_vec(), expected);

    let single = single::Message { step: 0, y_ref: [-1.5, 0.5], z_ref: [], certified: false, plan: 0 };
    let written: [u8; HEADER_BYTES + 8] = single.to_bytes(&SENDER);
    assert_eq!((&written[..4], &written[28..32]), (&[1, 4, 0, 0][..], &[2, 0, 0, 0][..]));
    assert_eq!(written[32..], [0, 0, 0xc0, 0xbf, 0, 0, 0, 0x3f]);
}

#[test]
fn every_message_comes_back_bit_by_bit() {
    let mut random = Random::new(1);
    for _ in 0..10_000 {
        let sent = Message::<3, 2> {
            step: random.bits() as i64,
            y_ref: std::array::from_fn(|_| f64::from_bits(random.bits())),
            z_ref: std::array::from_fn(|_| f64::from_bits(random.bits())),
            certified: random.bits().is_multiple_of(2),
            plan: random.bits() as u32,
        };
        let sender = Sender { design: random.bits(), place: random.bits() as u32 };
        let bytes: [u8; Message::<3, 2>::BYTES] = sent.to_bytes(&sender);
        let got = Message::<3, 2>::from_bytes(&sender, &bytes).unwrap();
        assert_eq!((got.step, got.certified, got.plan), (sent.step, sent.certified, sent.plan));
        assert_eq!(got.y_ref.map(f64::to_bits), sent.y_ref.map(f64::to_bits));
        assert_eq!(got.z_ref.map(f64::to_bits), sent.z_ref.map(f64::to_bits));
        assert_eq!(Sender::place_in(&bytes), Ok(sender.place));
    }
}

#[test]
fn whatever_differs_is_refused_with_its_reason() {
    let changed = |at: usize, byte: u8| {
        let mut bytes = bytes(-1);
        bytes[at] = byte;
        PairMessage::from_bytes(&SENDER, &bytes).map(drop)
    };
    assert_eq!(changed(0, 2), Err(Refused::OtherLayout { expected: 1, got: 2 }));
    assert_eq!(changed(1, 4), Err(Refused::OtherScalar { expected: 8, got: 4 }));
    assert_eq!(changed(2, 3), Err(Refused::Malformed));
    assert_eq!(changed(4, 2), Err(Refused::OtherSender { expected: 1, got: 2 }));
    let got = 0x0123_4567_89ab_cd00;
    assert_eq!(changed(8, 0), Err(Refused::OtherDesign { expected: SENDER.design, got }));
    assert_eq!(changed(28, 2), Err(Refused::Malformed));
    assert_eq!(changed(31, 1), Err(Refused::Malformed));

    let long = [bytes(-1).to_vec(), vec![0]].concat();
    for length in (0..BYTES).chain([BYTES + 1]) {
        let expected = if length < HEADER_BYTES { HEADER_BYTES } else { BYTES };
        let read = PairMessage::from_bytes(&SENDER, &long[..length]);
        assert_eq!(read, Err(Refused::Length { expected, got: length }), "{length}");
    }
}

/// What was filed as bytes is what was filed as a message: every step after is the same.
#[test]
fn bytes_are_as_good_as_the_message() {
    let tables = pair::tables();
    let start = || PairController::start(&tables, &SteadyState { x: [0.0], u: [0.0] }).unwrap().0;
    let (mut one, mut other) = (start(), start());
    let (mut by_message, mut by_bytes) = (PairInbox::<0>::new(), PairInbox::new());
    for t in 0..50 {
        let message = Message { step: t - 1, y_ref: [0.0], z_ref: [1e-3 * t as f64], certified: true, plan: 0 };
        by_message.accept(&OTHER, &message).unwrap();
        by_bytes.accept_bytes(&OTHER, &message.to_bytes::<BYTES>(&SENDER)).unwrap();
        let steps = [one.step(&[0.01], &[1.0], &mut by_message), other.step(&[0.01], &[1.0], &mut by_bytes)];
        let [first, second] = steps.map(|step| (step.input, step.message, step.status));
        assert_eq!(first, second);
    }
}

#[test]
fn the_status_says_what_came_instead() {
    let status_after = |link: &Link<1, 1>, bytes: &[u8]| {
        let tables = pair::tables();
        let (mut controller, _) = PairController::start(&tables, &SteadyState { x: [0.0], u: [0.0] }).unwrap();
        let mut inbox = PairInbox::<0>::new();
        let refused = inbox.accept_bytes(link, bytes).unwrap_err();
        let step = controller.step(&[0.0], &[0.0], &mut inbox);
        assert!(!step.status.is_guaranteed());
        (refused, step.status.deliveries)
    };
    let updated = Link { sender: Sender { design: 1, ..SENDER }, ..OTHER };
    let (refused, deliveries) = status_after(&updated, &bytes(-1));
    assert_eq!(refused, Refused::OtherDesign { expected: 1, got: SENDER.design });
    assert_eq!(
        refused.to_string(),
        "message of design 0123456789abcdef, this controller is of design 0000000000000001"
    );
    assert_eq!(deliveries, [Delivery::OtherDesign]);
    assert_eq!(status_after(&OTHER, &bytes(-1)[1..]).1, [Delivery::Unreadable]);
    assert_eq!(status_after(&OTHER, &bytes(5)).1, [Delivery::OutOfSequence(5)]);
    let undefined = PairMessage { y_ref: [f64::NAN], ..message(-1) };
    assert_eq!(status_after(&OTHER, &undefined.to_bytes::<BYTES>(&SENDER)).1, [Delivery::NotFinite]);
}

/// Trouble after the right message takes nothing back.
#[test]
fn the_right_message_counts_whatever_else_comes() {
    let mut inbox = PairInbox::<0>::new();
    inbox.accept_bytes(&OTHER, &[]).unwrap_err();
    inbox.accept_bytes(&OTHER, &bytes(-1)).unwrap();
    inbox.accept_bytes(&OTHER, &[1]).unwrap_err();
    assert!(inbox.arrived(0));
}

/// Noise is refused, or is the message that these very bytes are.
#[test]
fn no_bytes_are_too_bad_to_read() {
    let (mut random, mut accepted) = (Random::new(2), 0);
    for _ in 0..20_000 {
        let mut noisy = bytes(-1).to_vec();
        for _ in 0..1 + random.bits() % 8 {
            let at = random.below(noisy.len());
            noisy[at] ^= 1 << (random.bits() % 8);
        }
        if random.bits().is_multiple_of(4) {
            noisy.truncate(random.below(BYTES));
        }
        let mut inbox = PairInbox::<0>::new();
        if inbox.accept_bytes(&OTHER, &noisy).is_ok() {
            let read = PairMessage::from_bytes(&SENDER, &noisy).unwrap();
            assert_eq!(read.to_bytes::<BYTES>(&SENDER).to_vec(), noisy);
            accepted += 1;
        }
    }
    assert!(accepted > 100, "{accepted} that differ in the numbers alone");
}
