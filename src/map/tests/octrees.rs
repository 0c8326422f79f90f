//! Octrees, their bytes made here by a writer without any cleverness.

use std::collections::BTreeMap;

use super::*;
use proptest::prelude::*;

/// A node as a test writes it: eight children or a leaf.
#[derive(Debug, Clone)]
pub enum Node {
    Unseen,
    Leaf(bool),
    Inner(Vec<Node>),
}

use Node::{Inner, Leaf, Unseen};

impl Node {
    /// An inner node with these children, all others unknown.
    fn of(children: &[(usize, Node)]) -> Self {
        let mut all = vec![Unseen; 8];
        children.iter().for_each(|(number, node)| all[*number] = node.clone());
        Inner(all)
    }

    fn count(&self) -> usize {
        match self {
            Unseen => 0,
            Leaf(_) => 1,
            Inner(children) => 1 + children.iter().map(Node::count).sum::<usize>(),
        }
    }

    fn bits(&self, out: &mut Vec<u8>) {
        let Inner(children) = self else { return };
        let state = |node: &Node| match node {
            Unseen => 0u16,
            Leaf(false) => 1,
            Leaf(true) => 2,
            Inner(_) => 3,
        };
        let bits = children.iter().enumerate().fold(0, |bits, (k, node)| bits | state(node) << (2 * k));
        out.extend(bits.to_le_bytes());
        children.iter().for_each(|node| node.bits(out));
    }

    fn records(&self, colour: &[u8], out: &mut Vec<u8>) {
        let (log_odds, children) = match self {
            Unseen => return,
            Leaf(occupied) => (if *occupied { 0.85f32 } else { -0.4 }, &[][..]),
            Inner(children) => (0.0, &children[..]),
        };
        out.extend(log_odds.to_le_bytes());
        out.extend(colour);
        out.push(children.iter().enumerate().fold(0, |bits, (k, n)| bits | u8::from(n.count() > 0) << k));
        children.iter().for_each(|node| node.records(colour, out));
    }
}

fn head(first: &str, id: &str, size: usize) -> Vec<u8> {
    format!("{first}\n# (feel free to add / change comments)\n#\nid {id}\nsize {size}\nres 0.1\ndata\n").into_bytes()
}

/// A `.bt` with cells of 0.1 m.
pub fn bt(root: &Node) -> Vec<u8> {
    let mut out = head("# Octomap OcTree binary file", "OcTree", root.count());
    root.bits(&mut out);
    out
}

/// A `.ot` with cells of 0.1 m.
pub fn ot(root: &Node) -> Vec<u8> {
    let mut out = head("# Octomap OcTree file", "OcTree", root.count());
    root.records(&[], &mut out);
    out
}

/// Fourteen levels down, to the corner at the origin of the octant above zero: then 4 x 4 x 4 cells from 0 to 0.4 m.
fn at_origin(inner: Node) -> Node {
    let mut node = inner;
    for _ in 0..13 {
        node = Node::of(&[(0, node)]);
    }
    Node::of(&[(7, node)])
}

/// 4 x 4 x 4 cells from 0 to 0.4 m: a coarse occupied leaf at (0.2, 0, 0), a coarse free one at (0, 0, 0), and single cells at the
/// corner (0.2, 0.2, 0): one occupied, one free; all else unknown.
pub fn small() -> Node {
    let corner = Node::of(&[(0, Leaf(true)), (7, Leaf(false))]);
    at_origin(Node::of(&[(0, Leaf(false)), (1, Leaf(true)), (3, corner)]))
}

fn cells_of(map: &VoxelMap) -> Vec<[i64; 3]> {
    let first = map.origin.map(|c| (c / map.resolution).round() as i64);
    map.cells().map(|c| [0, 1, 2].map(|a| first[a] + c[a] as i64)).collect()
}

#[test]
fn leaves_of_any_depth_are_cubes_and_what_no_leaf_covers_is_unknown() {
    for (name, file) in [("a.bt", bt(&small())), ("a.ot", ot(&small()))] {
        let free = good(name, &file, &MapSpec { unknown: Unknown::Free, ..spec([-1.0, 1.0]) });
        assert_eq!((free.resolution, free.origin, free.dims), (0.1, [0.0; 3], [4, 4, 2]), "{name}");
        let mut expected: Vec<[i64; 3]> =
            (2..4).flat_map(|i| (0..2).flat_map(move |j| (0..2).map(move |k| [i, j, k]))).collect();
        expected.push([2, 2, 0]);
        expected.sort_unstable();
        assert_eq!(cells_of(&free), expected, "{name}");
        let walled = good(name, &file, &spec([-1.0, 1.0]));
        assert_eq!(walled.dims, free.dims);
        // Of 32 cells, 8 and 1 are known to be free.
        assert_eq!((walled.occupied_count(), walled.statistics.unknown), (32 - 9, 32 - 9 - 9));
        assert!(!walled.occupied([3, 3, 1]) && walled.occupied([3, 3, 0]) && walled.occupied([0, 3, 0]));
    }
}

#[test]
fn an_octree_is_known_by_its_first_line_not_by_its_ending() {
    let spec = spec([-1.0, 1.0]);
    assert_eq!(good("a.ot", &bt(&small()), &spec), good("a.bt", &ot(&small()), &spec));
}

#[test]
fn coloured_trees_have_longer_records() {
    let mut file = head("# Octomap OcTree file", "ColorOcTree", small().count());
    small().records(&[1, 2, 3], &mut file);
    assert_eq!(good("a.ot", &file, &spec([-1.0, 1.0])), good("a.ot", &ot(&small()), &spec([-1.0, 1.0])));
}

#[test]
fn layers_whose_centre_is_outside_the_slab_are_cut() {
    let map = good("a.bt", &bt(&small()), &MapSpec { unknown: Unknown::Free, ..spec([0.1, 0.3]) });
    assert_eq!((map.dims, map.origin[2], map.occupied_count(), map.statistics.cut), ([4, 4, 1], 0.1, 4, 5));
    let none = good("a.bt", &bt(&small()), &spec([5.0, 6.0]));
    assert_eq!((none.dims, none.occupied_count()), ([4, 4, 1], 0));
}

#[test]
fn other_cells_than_the_trees_own_cover_all_of_its_leaves() {
    let with = |resolution, unknown| {
        good("a.bt", &bt(&small()), &MapSpec { resolution: Some(resolution), unknown, ..spec([-1.0, 1.0]) })
    };
    // Half the size: eight for each, no more.
    let finer = with(0.05, Unknown::Free);
    assert_eq!((finer.dims, finer.occupied_count()), ([8, 8, 4], 72));
    let walled = with(0.05, Unknown::Occupied);
    assert_eq!((walled.occupied_count(), walled.statistics.unknown), (8 * 23, 8 * 14));
    // 0.15 m: cells 0.15 to 0.3 and 0.3 to 0.45 m reach into the leaf from 0.2 to 0.4 m.
    let odd = with(0.15, Unknown::Free);
    assert_eq!(odd.dims, [3, 3, 2]);
    let columns: Vec<[i64; 3]> = cells_of(&odd).into_iter().filter(|c| c[2] == 0).collect();
    assert_eq!(columns, [[1, 0, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]]);
    // Beyond 0.4 m nothing was seen: the last cells along x and y, which reach there, are obstacles.
    let odd = with(0.15, Unknown::Occupied);
    assert!((0..3).all(|c| odd.occupied([2, c, 0]) && odd.occupied([c, 2, 1])) && !odd.occupied([0, 0, 0]));
    assert_eq!(good("a.bt", &bt(&small()), &spec([-1.0, 1.0])), with(0.1, Unknown::Occupied));
}

#[test]
fn what_is_wrong_with_a_tree_is_said_with_its_place() {
    let wrong = |file: &[u8]| bad("a.bt", file, &spec([-1.0, 1.0])).remove(0);
    let (file, full) = (bt(&small()), ot(&small()));
    let nodes = small().count();
    let begin = file.len() - 2 * 16;
    assert_eq!(wrong(b"# Octree\n").0, "map/format");
    assert_eq!(wrong(&file[..40]).0, "map/header");
    let cut = wrong(&file[..file.len() - 1]);
    let message = format!(
        "the tree is cut off at byte {} of the file: a node needs 2 bytes, 1 are left; {} of {nodes} nodes read",
        file.len() - 2,
        nodes - 2
    );
    assert_eq!(cut, ("map/truncated", message));
    assert_eq!(wrong(&[&file[..], b"more"].concat()).0, "map/surplus");
    let surplus = wrong(&[&full[..], b"more"].concat());
    assert_eq!(surplus.0, "map/surplus", "{surplus:?}");
    assert_eq!(wrong(&full[..full.len() - 1]).0, "map/truncated");
    let text = String::from_utf8(file[..begin].to_vec()).expect("a header");
    let with = |from: &str, to: &str| [text.replace(from, to).as_bytes(), &file[begin..]].concat();
    let size = format!("size {nodes}");
    assert_eq!(wrong(&with(&size, "size 18446744073709551615")).0, "map/truncated");
    assert_eq!(wrong(&with(&size, "size 21")).0, "map/surplus");
    for (from, to) in [
        (&size[..], "size many"),
        (&size, "size 1\nsize 2"),
        ("id OcTree", "id SemanticOcTree"),
        ("id OcTree\n", ""),
        ("res 0.1", "res 0"),
        ("res 0.1", "res nan"),
    ] {
        assert_eq!(wrong(&with(from, to)).0, "map/header", "{to}");
    }
    assert_eq!(wrong(&with(&size, "size 0")).0, "map/no-points");
    // Seventeen levels.
    let mut deep = Leaf(true);
    for _ in 0..17 {
        deep = Node::of(&[(0, deep)]);
    }
    assert_eq!(wrong(&bt(&deep)).0, "map/damaged");
    assert_eq!(wrong(&ot(&deep)).0, "map/damaged");
    let mut no_number = full;
    let end = no_number.len();
    no_number[end - 5..end - 1].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(wrong(&no_number).0, "map/damaged");
    // An occupied root: cells of a thousand kilometres.
    assert_eq!(wrong(&ot(&Leaf(true))).0, "map/too-large");
}

fn node(depth: u32) -> impl Strategy<Value = Node> {
    let leaf = prop_oneof![2 => Just(Unseen), 1 => Just(Leaf(true)), 2 => Just(Leaf(false))];
    // No inner node without children: of records that is what a leaf is.
    let inner =
        |children: Vec<Node>| if children.iter().all(|c| c.count() == 0) { Leaf(false) } else { Inner(children) };
    leaf.prop_recursive(depth, 64, 8, move |below| prop::collection::vec(below, 8).prop_map(inner))
}

/// State of each cell by going down the tree; `low` in cells.
fn by_cell(node: &Node, low: [i64; 3], side: i64, out: &mut BTreeMap<[i64; 3], bool>) {
    match node {
        Unseen => {}
        Leaf(occupied) => {
            for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
                out.extend((0..side).map(|k| ([low[0] + i, low[1] + j, low[2] + k], *occupied)));
            }
        }
        Inner(children) => {
            for (number, child) in children.iter().enumerate() {
                let half = side / 2;
                by_cell(child, [0, 1, 2].map(|a| low[a] + half * (number as i64 >> a & 1)), half, out);
            }
        }
    }
}

proptest! {
    #[test]
    fn cells_are_those_of_the_tree_at_any_resolution(
        tree in node(3), free in any::<bool>(), resolution in prop::sample::select(vec![0.1, 0.05, 0.07, 0.13, 0.3]),
    ) {
        // Eight cells a side from 0 to 0.8 m.
        let mut root = tree.clone();
        for _ in 0..12 {
            root = Node::of(&[(0, root)]);
        }
        let root = Node::of(&[(7, root)]);
        let mut cells = BTreeMap::new();
        by_cell(&tree, [0; 3], 8, &mut cells);
        prop_assume!(!cells.is_empty());
        let unknown = if free { Unknown::Free } else { Unknown::Occupied };
        let spec = MapSpec { resolution: Some(resolution), unknown, ..spec([-10.0, 10.0]) };
        let map = good("a.bt", &bt(&root), &spec);
        prop_assert_eq!(&map, &good("a.ot", &ot(&root), &spec));
        let range = |a: usize| {
            let of = || cells.keys().map(move |c| c[a]);
            (of().min().expect("some"), of().max().expect("some") + 1)
        };
        let [x, y, z] = [range(0), range(1), range(2)];
        let mut expected = std::collections::BTreeSet::new();
        let cells = &cells;
        for (i, j, k) in (x.0 - 4..x.1 + 4).flat_map(|i| (y.0 - 4..y.1 + 4).flat_map(move |j| (z.0..z.1).map(move |k| (i, j, k)))) {
            let solid = match cells.get(&[i, j, k]) {
                Some(occupied) => *occupied,
                None => !free,
            };
            if solid {
                // All cells of the asked size that overlap this one by more than rounding.
                let span = |c: i64| {
                    let [low, high] = [c as f64 * 0.1, (c + 1) as f64 * 0.1];
                    ((low / resolution + 1e-6).floor() as i64)..((high / resolution - 1e-6).ceil() as i64)
                };
                for a in span(i) { for b in span(j) { for c in span(k) { expected.insert([a, b, c]); } } }
            }
        }
        // Beyond the grid sideways everything is an obstacle or nothing; it is not the map's to say.
        let first = map.origin.map(|c| (c / resolution).round() as i64);
        expected.retain(|c| (0..2).all(|a| first[a] <= c[a] && c[a] < first[a] + map.dims[a] as i64));
        let found: std::collections::BTreeSet<[i64; 3]> = cells_of(&map).into_iter().collect();
        // Cells that reach beyond the grid are full columns, whatever the height of what is unknown beside them.
        prop_assert_eq!(found, expected);
    }
}
