// The commands over time, and where they put the robot.

/** Values from the first one and the differences of neighbours, in units of 1/scale. */
function summed(differences, scale) {
  let sum = 0;
  return Float64Array.from(differences, (d) => { sum += d; return sum / scale; });
}

/** The rows of the page's data as lists of values; null where the mission has none. */
function readRows(rows) {
  if (!rows) return null;
  const list = (key) => summed(rows[key], rows.scale);
  return {
    step: rows.step, end: rows.end, count: rows.x.length,
    x: list('x'), y: list('y'), yaw: list('yaw'), left: list('left'), right: list('right'),
    joints: rows.joints.map((j) => summed(j, rows.scale)),
  };
}

/** What the robot does at a time: pose, joint values, rim speeds. While a row is held the base drives an arc and joints move evenly. */
function stateAt(rows, time) {
  const last = rows.count - 1;
  const k = Math.max(0, Math.min(last, Math.floor(time / rows.step + 1e-9)));
  const next = Math.min(last, k + 1);
  const share = next === k ? 0 : Math.max(0, Math.min(1, time / rows.step - k));
  const between = (list) => list[k] + share * (list[next] - list[k]);
  const pose = arc([rows.x[k], rows.y[k], rows.yaw[k]], [rows.x[next], rows.y[next], rows.yaw[next]], share);
  return { row: k, pose, joints: rows.joints.map(between), left: rows.left[k], right: rows.right[k] };
}

/** The pose at a share of the circular arc between two poses: the base's way at a constant twist. */
function arc(from, to, share) {
  const half = 0.5 * (to[2] - from[2]);
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const scale = Math.abs(half) < 1e-6 ? share : Math.sin(share * half) / Math.sin(half);
  const turn = (share - 1) * half;
  const [c, s] = [Math.cos(turn) * scale, Math.sin(turn) * scale];
  return [from[0] + c * dx - s * dy, from[1] + s * dx + c * dy, from[2] + 2 * share * half];
}

/** Frames of all shapes on the map: forward kinematics. Shapes that need joint values which are not known have none. */
function shapeFrames(robot, pose, joints) {
  const base = frameOfPose(pose);
  const bodies = [];
  for (const body of robot.bodies) {
    const origin = frameOf(body.origin);
    if (!body.motion) { bodies.push(compose(base, origin)); continue; }
    const parent = bodies[body.parent];
    if (!joints || !parent) { bodies.push(null); continue; }
    const { joint, multiplier, offset, axis, prismatic } = body.motion;
    const value = multiplier * joints[joint] + offset;
    const moved = prismatic ? frameOf([...axis.map((a) => a * value), 0, 0, 0, 1]) : turnAbout(axis, value);
    bodies.push(compose(compose(parent, origin), moved));
  }
  return robot.shapes.map((shape) => bodies[shape.body] && compose(bodies[shape.body], shape.frame));
}

/** The robot of the page's data, ready for use: corners in metres, each shape's frame in its body, whether a joint moves it. */
function readRobot(robot) {
  const shapes = robot.shapes.map((shape) => {
    const points = [];
    for (let i = 0; i < shape.solid.points.length; i += 3) points.push([0, 1, 2].map((a) => shape.solid.points[i + a] * 1e-5));
    return { ...shape, points, frame: frameOf(shape.pose), moved: robot.bodies[shape.body].motion !== null };
  });
  return { ...robot, shapes };
}

/** Outlines on the floor of all shapes at a pose. */
function footprint(robot, pose, joints) {
  const frames = shapeFrames(robot, pose, joints);
  return robot.shapes.flatMap((shape, s) => (frames[s] ? [outlineOf(shape.points.map((p) => carry(frames[s], p)))] : []));
}

/** How far the robot moves from the row before, m; a radian counts as `lever` m. */
function moveTo(rows, k, lever) {
  const turned = rows.joints.reduce((sum, joint) => sum + Math.abs(joint[k] - joint[k - 1]), Math.abs(rows.yaw[k] - rows.yaw[k - 1]));
  return Math.hypot(rows.x[k] - rows.x[k - 1], rows.y[k] - rows.y[k - 1]) + lever * turned;
}

/** How far the robot moves in all. */
function wayLength(rows, lever) {
  let way = 0;
  for (let k = 1; k < rows.count; k += 1) way += moveTo(rows, k, lever);
  return way;
}

/** Times along a motion, the first and the last among them, between which the robot moves by `reach`. */
function timesAlong(rows, reach, lever) {
  const times = [0];
  let way = 0;
  for (let k = 1; k < rows.count; k += 1) {
    const move = moveTo(rows, k, lever);
    // Several within one row where it is fast.
    let rest = move;
    while (way + rest >= reach) {
      rest -= reach - way;
      way = 0;
      times.push((k - rest / move) * rows.step);
    }
    way += rest;
  }
  if (times[times.length - 1] < rows.end) times.push(rows.end);
  return times;
}
