//! How many edges of a side run which way, and a course changed to have other numbers of them (section 4.3).

use super::courses::Course;

/// Edges of a side: straight on, to the left, to the right.
pub(super) type Counts = [i32; 3];

/// The counts of a course.
pub(super) fn counts_of(course: &Course) -> Counts {
    [0, 1, -1].map(|letter| course.iter().filter(|&&offset| offset == letter).count() as i32)
}

/// A course with other counts: edges are taken away and turned ones put in about a position, 0 to 1; with `spread` the new
/// ones lie apart. Of edges to both sides those come first that `leads` says.
pub(super) fn changed(old: &Course, counts: Counts, position: f64, spread: bool, leads: i8) -> Course {
    let length = old.len().max(1) as f64;
    let mut placed: Vec<(f64, i8)> =
        old.iter().enumerate().map(|(k, &letter)| ((k as f64 + 0.5) / length, letter)).collect();
    let now = counts_of(old);
    let letters = [0, 1, -1];
    for (k, letter) in letters.into_iter().enumerate() {
        for _ in counts[k]..now[k] {
            let nearest = (0..placed.len())
                .filter(|&i| placed[i].1 == letter)
                .min_by(|&a, &b| (placed[a].0 - position).abs().total_cmp(&(placed[b].0 - position).abs()));
            if let Some(i) = nearest {
                placed.remove(i);
            }
        }
    }
    let extra = [1, 2].map(|k| (counts[k] - now[k]).max(0));
    let both = extra.iter().all(|&n| n > 0);
    for (k, letter) in letters.into_iter().enumerate() {
        let count = (counts[k] - now[k]).max(0);
        for i in 0..count {
            let even = (f64::from(i) + 0.5) / f64::from(count);
            let at = if letter == 0 || (spread && !both) {
                even
            } else if spread {
                even + if letter == leads { -0.25 } else { 0.25 } / f64::from(count)
            } else if both {
                position + if letter == leads { -0.17 } else { 0.17 }
            } else {
                position
            };
            placed.push((at, letter));
        }
    }
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    placed.into_iter().map(|(_, letter)| letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_takes_its_zigzag_where_it_is_wished() {
        assert_eq!(changed(&vec![0; 6], [4, 2, 0], 0.5, false, 1), [0, 0, 1, 1, 0, 0]);
        assert_eq!(changed(&vec![0; 6], [4, 2, 0], 0.0, false, 1), [1, 1, 0, 0, 0, 0]);
        assert_eq!(changed(&vec![0; 4], [4, 0, 2], 0.5, true, 1), [0, -1, 0, 0, -1, 0]);
        assert_eq!(changed(&vec![0; 6], [4, 1, 1], 0.5, false, -1), [0, 0, -1, 1, 0, 0]);
        assert_eq!(counts_of(&changed(&vec![1, -1, 0], [2, 0, 1], 0.3, false, 1)), [2, 0, 1]);
    }
}
