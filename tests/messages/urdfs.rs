//! Mistakes in a URDF and its meshes.

use super::case::{Case, ROBOT, URDF, Why, case};

const BOX: &str = "<box size=\"0.40 0.40 0.30\"/>";

fn urdf(name: &'static str, from: &'static str, to: &'static str) -> Case {
    case(name).edit(URDF, from, to)
}

/// One joint more.
fn joint(name: &'static str, joint: &'static str) -> Case {
    case(name).with(move |s| s.edit(URDF, "</robot>", &format!("{joint}\n</robot>")))
}

pub fn cases() -> Vec<Case> {
    let mut all = xml();
    all.extend(tree());
    all.extend(elements());
    all.extend(wheels());
    all.extend(meshes());
    all
}

fn xml() -> Vec<Case> {
    vec![
        case("empty").write(URDF, "").at_the_top(URDF).nothing_found(Why::WholeFile).expected("a <robot>").hint("<robot name="),
        case("never_closed").write(URDF, "<robot name=\"x\">\n  <link name=\"a\">\n").at(URDF, "<link name")
            .found("ends").expected("</link>").hint("closing tag"),
        urdf("closed_by_another", "</link>\n\n  <link name=\"left", "</joint>\n\n  <link name=\"left").at(URDF, "</joint>\n\n  <link name=\"left")
            .found("</joint>").expected("</link>").hint("closing tag"),
        urdf("quote_missing", "<link name=\"left_wheel\"/>", "<link name=left_wheel/>").at(URDF, "name=|left_wheel/>").found("'l'")
            .expected("quote").hint("quotes"),
        urdf("attribute_twice", "<link name=\"left_wheel\"/>", "<link name=\"left_wheel\" name=\"b\"/>").at(URDF, "|name=\"b\"")
            .found("'name'").expected("once").hint("keep one"),
        urdf("doctype", "<robot name", "<!DOCTYPE robot>\n<robot name").at(URDF, "<!DOCTYPE").found("<!DOCTYPE>").nothing_expected()
            .hint("remove them"),
        case("other_root").write(URDF, "<sdf version=\"1.6\"/>\n").at(URDF, "<sdf").found("<sdf>").expected("<robot>").hint("convert"),
        urdf("xacro_value", BOX, "<box size=\"${width} 0.40 0.30\"/>").at(URDF, "size=\"${").found("${width}")
            .expected("3 finite numbers").hint("expand it first"),
        urdf("xacro_element", "<robot name=\"box_base\">",
            "<robot name=\"box_base\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:include filename=\"a.xacro\"/>")
            .at(URDF, "<xacro:include").found("<xacro:include>").expected("not yet a URDF").hint("`xacro robots/box_base/box_base.urdf"),
        case("not_utf8").write(URDF, b"<robot name=\"\xff\"/>").at(URDF, "\u{fffd}").found("byte 13").expected("UTF-8")
            .hint("save the file as UTF-8"),
        urdf("nested_deep", BOX, "<a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a></a>")
            .at(URDF, "|<a><a></a></a>").found("nested").expected("64 deep").hint("closing tag"),
    ]
}

fn tree() -> Vec<Case> {
    vec![
        urdf("no_link", "<link", "<part").with(|s| {
                let text = s.text(URDF).replace("</link", "</part");
                s.write(URDF, text);
            })
            .at(URDF, "<robot name").nothing_found(Why::Missing).expected("<link>").hint("<link name="),
        urdf("link_twice", "<link name=\"right_wheel\"/>", "<link name=\"right_wheel\"/><link name=\"right_wheel\"/>")
            .at(URDF, "/><link |name=\"right_wheel\"").found("`right_wheel`").expected("twice").hint("rename"),
        urdf("joint_twice", "<joint name=\"right_wheel_joint\"", "<joint name=\"left_wheel_joint\"")
            .at(URDF, "<link name=\"right_wheel\"/>\n  <joint |name=\"left_wheel_joint\"").found("joint `left_wheel_joint`").expected("twice")
            .hint("own name"),
        urdf("nameless", "<link name=\"right_wheel\"/>", "<link/>").at(URDF, "<link/>").nothing_found(Why::Missing)
            .expected("without a name").with(|s| s.edit(URDF, "<child link=\"right_wheel\"/>", "<child link=\"left_wheel\"/>"))
            .hint("name=\""),
        urdf("child_unknown", "<child link=\"right_wheel\"/>", "<child link=\"right_weel\"/>").at(URDF, "link=\"right_weel\"")
            .found("`right_weel`").expected("link").hint("did you mean `right_wheel`?"),
        urdf("no_child", "<child link=\"right_wheel\"/>", "").at(URDF, "name=\"right_wheel_joint\"").nothing_found(Why::Missing)
            .expected("<child link=").hint("add <child link="),
        joint("mimic_unknown", "<link name=\"a\"/><joint name=\"lift\" type=\"prismatic\"><parent link=\"base_link\"/><child link=\"a\"/><axis xyz=\"0 0 1\"/><limit lower=\"0\" upper=\"1\" velocity=\"1\"/><mimic joint=\"lfit\"/></joint>")
            .at(URDF, "joint=\"lfit\"").found("`lfit`").expected("joint").hint("did you mean `lift`?"),
        joint("mimic_circle", "<link name=\"a\"/><joint name=\"lift\" type=\"prismatic\"><parent link=\"base_link\"/><child link=\"a\"/><axis xyz=\"0 0 1\"/><limit lower=\"0\" upper=\"1\" velocity=\"1\"/><mimic joint=\"lift\"/></joint>")
            .at(URDF, "name=\"lift\"").found("`lift`").expected("circle").hint("<mimic"),
        joint("circle", "<joint name=\"back\" type=\"fixed\"><parent link=\"left_wheel\"/><child link=\"base_link\"/></joint>")
            .at(URDF, "name=\"back\"").found("`base_link`, `left_wheel`").expected("circle").hint("tree"),
        joint("two_parents", "<joint name=\"more\" type=\"fixed\"><parent link=\"left_wheel\"/><child link=\"right_wheel\"/></joint>")
            .at(URDF, "name=\"more\"").found("`right_wheel_joint` and `more`").expected("child of two joints").hint("remove one"),
        joint("two_roots", "<link name=\"camera\"/>").at(URDF, "name=\"camera\"").found("2 links").expected("one tree")
            .hint("join them with fixed joints"),
    ]
}

fn elements() -> Vec<Case> {
    vec![
        urdf("joint_type", "joint\" type=\"continuous\">\n    <parent link=\"base_link\"/>\n    <child link=\"left", "joint\" type=\"continous\">\n    <parent link=\"base_link\"/>\n    <child link=\"left")
            .at(URDF, "type=\"continous\"").found("`continous`").expected("fixed, revolute, continuous or prismatic").hint("did you mean `continuous`?"),
        joint("joint_floating", "<link name=\"a\"/><joint name=\"fly\" type=\"floating\"><parent link=\"base_link\"/><child link=\"a\"/></joint>")
            .at(URDF, "type=\"floating\"").found("`floating`").expected("fixed, revolute, continuous or prismatic").hint("use fixed"),
        joint("no_type", "<link name=\"a\"/><joint name=\"arm\"><parent link=\"base_link\"/><child link=\"a\"/></joint>")
            .at(URDF, "name=\"arm\"").nothing_found(Why::Missing).expected("`arm` has no type").hint("type=\""),
        joint("two_origins", "<link name=\"a\"/><joint name=\"arm\" type=\"fixed\"><parent link=\"base_link\"/><child link=\"a\"/><origin/><origin /></joint>")
            .at(URDF, "<origin />").found("more than one <origin>").expected("one").hint("keep one"),
        joint("axis_zero", "<link name=\"a\"/><joint name=\"arm\" type=\"continuous\"><parent link=\"base_link\"/><child link=\"a\"/><axis xyz=\"0 0 0\"/></joint>")
            .at(URDF, "<axis xyz=\"0 0 0\"").found("zero length").expected("`arm`").hint("xyz=\"0 0 1\""),
        joint("limits_crossed", "<link name=\"a\"/><joint name=\"arm\" type=\"revolute\"><parent link=\"base_link\"/><child link=\"a\"/><limit lower=\"2\" upper=\"1\" velocity=\"1\"/></joint>")
            .at(URDF, "<limit lower=\"2\"").found("lower limit 2").expected("the upper one, 1").hint("swap"),
        joint("velocity_negative", "<link name=\"a\"/><joint name=\"arm\" type=\"revolute\"><parent link=\"base_link\"/><child link=\"a\"/><limit lower=\"0\" upper=\"1\" velocity=\"-1\"/></joint>")
            .at(URDF, "<limit lower=\"0\"").found("-1").expected("negative velocity").hint("rad/s"),
        urdf("box_negative", BOX, "<box size=\"0.40 -0.40 0.30\"/>").at(URDF, "<box").found("-0.40").expected("negative")
            .hint("metres"),
        urdf("box_nan", BOX, "<box size=\"0.40 nan 0.30\"/>").at(URDF, "size=\"0.40 nan").found("nan").expected("3 finite numbers")
            .hint("size=\"0.4 0.4 0.3\""),
        urdf("box_comma", BOX, "<box size=\"0.40, 0.40, 0.30\"/>").at(URDF, "size=\"0.40,").found("0.40, 0.40")
            .expected("3 finite numbers").hint("blanks, not commas"),
        urdf("box_without_size", BOX, "<box/>").at(URDF, "<box/>").nothing_found(Why::Missing).expected("<box> has no size")
            .hint("size=\""),
        urdf("shape_unknown", BOX, "<cone radius=\"1\"/>").at(URDF, "<cone").found("<cone>").expected("box, cylinder, sphere or mesh")
            .hint("use box"),
        urdf("no_shape", BOX, "").at(URDF, "<collision>").found("no shape").expected("one <geometry> with one shape").hint("<box size="),
        urdf("no_collision", "collision>", "visual>").at(URDF, "<robot").nothing_found(Why::Missing).expected("collision shape")
            .hint("<collision>"),
        joint("slides_forever", "<link name=\"a\"/><joint name=\"lift\" type=\"prismatic\"><parent link=\"base_link\"/><child link=\"a\"/><axis xyz=\"0 0 1\"/></joint>")
            .edit(ROBOT, "limits:\n", "joints: {moving: [lift]}\nlimits:\n  joints: {lift: {speed: 1}}\n")
            .at(URDF, "name=\"lift\"").found("`lift` slides").expected("position limits").hint("upper=\""),
    ]
}

fn wheels() -> Vec<Case> {
    vec![
        case("no_wheels")
            .with(|s| {
                let line = s.text(ROBOT).lines().find(|l| l.starts_with("drive")).expect("drive").to_owned();
                s.edit(ROBOT, &line, "");
                s.edit(URDF, "type=\"continuous\"", "type=\"fixed\"");
            })
            .at(URDF, "<robot")
            .found("0 coaxial pairs")
            .expected("not one")
            .hint("drive.left and drive.right"),
        urdf(
            "wheel_fixed",
            "<joint name=\"left_wheel_joint\" type=\"continuous\"",
            "<joint name=\"left_wheel_joint\" type=\"fixed\"",
        )
        .at(ROBOT, "left_wheel_joint")
        .found("a fixed joint")
        .expected("does not turn")
        .hint("continuous"),
        urdf(
            "wheel_tilted",
            "<axis xyz=\"0 1 0\"/>\n    <limit effort=\"5\" velocity=\"6.25\"/>\n  </joint>\n\n  <link name=\"right",
            "<axis xyz=\"0 1 0.3\"/>\n    <limit effort=\"5\" velocity=\"6.25\"/>\n  </joint>\n\n  <link name=\"right",
        )
        .at(URDF, "name=\"left_wheel_joint\"")
        .found("tilted by 16.70 degrees")
        .expected("horizontal")
        .hint("<axis"),
        urdf("wheels_at_one_place", "0 -0.16 0.08", "0 0.16 0.08")
            .with(|s| s.edit(ROBOT, ", track_width_m: 0.32", ""))
            .at(URDF, "name=\"left_wheel_joint\"")
            .found("at one place")
            .expected("left and right")
            .hint("<origin"),
        urdf("wheels_not_coaxial", "0 -0.16 0.08", "0.1 -0.16 0.08")
            .at(URDF, "name=\"left_wheel_joint\"")
            .found("0.1000 m off")
            .expected("coaxial")
            .hint("<origin"),
    ]
}

fn meshes() -> Vec<Case> {
    let mesh =
        |name, mesh: &'static str| case(name).with(move |s| s.edit(URDF, BOX, &format!("<mesh filename=\"{mesh}\"/>")));
    vec![
        mesh("mesh_missing", "hull.stl")
            .write("robots/box_base/hul.stl", "")
            .at(URDF, "<collision>")
            .found("hull.stl")
            .expected("looked for robots/box_base/hull.stl")
            .hint("did you mean `hul.stl`?"),
        mesh("mesh_outside", "../hull.stl")
            .at(URDF, "<collision>")
            .found("../hull.stl")
            .expected("under the robot's folder")
            .hint("--allow-path DIR"),
        mesh("mesh_package", "package://bot/hull.stl")
            .at(URDF, "<collision>")
            .found("package://bot/hull.stl")
            .expected("robots/hull.stl")
            .hint("looked for"),
        mesh("mesh_scheme", "http://bot/hull.stl")
            .at(URDF, "<collision>")
            .found("`http://`")
            .expected("package://, file://")
            .hint("a path relative to the URDF"),
        mesh("mesh_kind", "hull.fbx")
            .write("robots/box_base/hull.fbx", "x")
            .at(URDF, "<collision>")
            .found("`.fbx`")
            .expected("STL or OBJ")
            .hint("convert it"),
        mesh("mesh_cut", "hull.stl")
            .write("robots/box_base/hull.stl", "solid nothing")
            .at(URDF, "<collision>")
            .found("0 vertices")
            .expected("`endsolid`")
            .hint("export it again"),
        mesh("mesh_folder", "hull.stl")
            .write("robots/box_base/hull.stl/x", "")
            .at(URDF, "<collision>")
            .found("is a folder")
            .expected("a file")
            .hint("the mesh file itself"),
        mesh("mesh_without_triangles", "hull.obj")
            .write("robots/box_base/hull.obj", "# nothing\n")
            .at(URDF, "<collision>")
            .found("no vertices")
            .expected("its triangles")
            .hint("export it again"),
        urdf("mesh_nameless", BOX, "<mesh/>")
            .at(URDF, "<mesh/>")
            .nothing_found(Why::Missing)
            .expected("filename")
            .hint("filename=\""),
    ]
}
