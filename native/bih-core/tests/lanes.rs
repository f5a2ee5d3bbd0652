//! Lanes of every instruction set against those of none. On an emulated ARM processor too: `make test-neon`.

use bih_core::simd::{Kernel, Lanes, Mask, Scalar, dispatch_to, instruction_sets};

const ODD: [f32; 8] = [0.0, -0.0, 1.5, -2.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-45];

struct Everything;

impl Kernel for Everything {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<u32> {
        let mut bits = Vec::new();
        for shift in 0..8 {
            let mut turned = ODD;
            turned.rotate_left(shift);
            let (a, b) = (L::load(&ODD), L::load(&turned));
            let values = [
                a.plus(b),
                a.minus(b),
                a.times(b),
                a.over(b),
                a.fused(b, L::splat(0.1)),
                a.magnitude(),
                a.turned_by(b),
                a.minimum(b),
                a.maximum(b),
                L::splat(turned[0]),
            ];
            // Which NaN comes out is not promised.
            let canonical = |x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
            bits.extend(values.iter().flat_map(|value| value.store().map(canonical)));
            let (most, less) = (a.at_most(b), a.below(b));
            let masks = [most, less, most.and(less), most.or(less), most.and_not(less)];
            bits.extend(masks.map(|mask| u32::from(mask.bits())));
            bits.extend(a.select(less, b).store().map(canonical));
            let given = L::mask(0b1011_0010u8.rotate_left(shift as u32));
            bits.push(u32::from(given.bits()));
            bits.extend(a.select(given.and(most), b).store().map(canonical));
            let finite = L::load(&turned.map(|x| if x.is_nan() { 7.0 } else { x }));
            let zeros = L::load(&turned.map(|x| if x > 0.0 { 0.0 } else { -0.0 }));
            for lanes in [finite, zeros] {
                bits.extend([lanes.smallest(), lanes.largest()].map(f32::to_bits));
            }
            let doubles = turned.map(|x| f64::from(x) * (1.0 + f64::EPSILON) + 1e-9);
            bits.extend(L::rounded(&doubles).store().map(canonical));
            let rows = L::transposed([a, b, a.plus(b), a.minus(b), L::splat(0.5), b, a.times(b), a]);
            for row in rows {
                bits.extend(row.store().map(canonical));
            }
            for order in [0x7654_3210, 0x0123_4567, 0x2706_1435u32.rotate_left(4 * shift as u32)] {
                let (mut nears, mut pushed) = ([0.0; 8], [0; 8]);
                let places = a.push(b, &[10, 11, 12, 13, 14, 15, 16, 17], order, &mut nears, &mut pushed);
                bits.push(u32::from(places));
                let count = places.count_ones() as usize;
                bits.extend(nears[..count].iter().map(|x| x.to_bits()));
                bits.extend(&pushed[..count]);
            }
        }
        bits
    }
}

#[test]
fn rows_become_columns() {
    let rows: [[f32; 8]; 8] = std::array::from_fn(|i| std::array::from_fn(|j| (10 * i + j) as f32));
    let columns = Scalar::transposed(rows.map(|row| Scalar::load(&row))).map(Lanes::store);
    assert!((0..64).all(|i| columns[i / 8][i % 8] == rows[i % 8][i / 8]));
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let expected = Everything.run::<Scalar>();
    for set in instruction_sets() {
        assert_eq!(dispatch_to(*set, Everything), expected, "{set:?}");
    }
}
