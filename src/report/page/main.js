// The page: reads its data, draws the view, moves time.

const PALETTES = {
  light: {
    stage: '#eef1f5', floor: '#fbfcfd', grid: '#e2e7ed', obstacle: '#c9d0da', crease: '#8f9aa9', edge: '#22303f',
    base: '#2f76bd', moved: '#e07f37', driven: '#16457a', ahead: '#9db7d2', route: '#8a6f9e', alert: '#c4271b',
  },
  dark: {
    stage: '#1a1f27', floor: '#212731', grid: '#2d3540', obstacle: '#566172', crease: '#8a97a8', edge: '#0d1116',
    base: '#5aa5ea', moved: '#f29a58', driven: '#9ccbf7', ahead: '#4b6a8a', route: '#a58fb8', alert: '#ff7a6e',
  },
};
const GHOSTS = 14; // postures drawn along the way

/** What is drawn, in metres, from the page's data. */
function readWorld(data) {
  const robot = readRobot(data.robot), rows = readRows(data.rows);
  const places = data.places.map((p) => ({ ...p, frames: shapeFrames(robot, p.pose, p.joints), solid: !rows && (p.kind === 'start' || p.kind === 'stuck') }));
  const way = rows && Array.from(rows.x, (x, k) => [x, rows.y[k]]);
  const reach = Math.max(0.2, ...robot.shapes.flatMap((s) => s.points.map((p) => Math.hypot(...carry(s.frame, p).slice(0, 2)))));
  const seen = [...(way || []), ...places.map((p) => p.pose), ...(data.gap ? [data.gap.at] : [])];
  const low = [0, 1].map((a) => Math.min(...seen.map((p) => p[a])) - reach);
  const high = [0, 1].map((a) => Math.max(...seen.map((p) => p[a])) + reach);
  const { map, closest } = data, gap = data.gap && data.gap.width < data.gap.needed - 1e-9 ? data.gap : null;
  const floor = map ? { low: map.origin.slice(0, 2), high: map.end } : { low: low.map((v) => v - 0.6), high: high.map((v) => v + 0.6) };
  const span = Math.max(high[0] - low[0], high[1] - low[1]);
  const rings = [];
  if (gap) rings.push({ at: gap.at, radius: Math.max(0.5 * gap.needed, 0.1) });
  if (closest && closest.obstacle) rings.push({ at: [0, 1].map((a) => 0.5 * (closest.obstacle.min[a] + closest.obstacle.max[a])), radius: 0.5 * reach });
  return {
    robot, rows, places, map, reach,
    boxes: map && readBoxes(map),
    floor: { ...floor, step: span > 60 ? 10 : span > 25 ? 5 : 1 },
    unit: span, low, high, way,
    zones: data.zones.map((zone) => [...zone.corners, zone.corners[0]]),
    route: data.route.length > 1 ? data.route : null,
    tint: rows && timesAlong(rows, Math.max(0.03, wayLength(rows, reach) / 700), reach)
      .flatMap((t) => { const s = stateAt(rows, t); return footprint(robot, s.pose, s.joints); }),
    ghosts: rows ? ghostTimes(rows, reach).map((t) => { const s = stateAt(rows, t); return { pose: s.pose, frames: shapeFrames(robot, s.pose, s.joints) }; }) : [],
    rings, gap, closest,
    cell: closest && closest.obstacle,
    labels: [...labelsOf(places, gap, closest), ...data.zones.map(({ corners, speed }) => (
      { at: [...[0, 1].map((a) => corners.reduce((sum, p) => sum + p[a], 0) / corners.length), 0.05], text: `${speed} m/s` }))],
  };
}

/** Instants at which postures are drawn along the way: not so many that they hide each other. */
function ghostTimes(rows, reach) {
  return timesAlong(rows, Math.max(1.1 * reach, wayLength(rows, reach) / GHOSTS), reach);
}

/** Words in the view. */
function labelsOf(places, gap, closest) {
  const labels = places.map((p) => ({ at: [p.pose[0], p.pose[1], 0.5], text: p.name, alert: p.kind === 'stuck' || p.link }));
  if (gap) labels.push({ at: [...gap.at, 0.3], text: `${gap.width.toFixed(2)} m wide, ${gap.needed.toFixed(2)} m needed`, alert: true });
  if (closest && closest.obstacle) {
    const { min, max } = closest.obstacle;
    labels.push({ at: [0, 1, 2].map((a) => 0.5 * (min[a] + max[a])), text: closestText(closest.distance_m), alert: true, aside: true });
  }
  return labels;
}

/** How near the closest approach is. */
function closestText(metres) {
  const mm = Math.abs(1e3 * metres).toFixed(1);
  return metres > 0 ? `closest: ${mm} mm` : `in collision: ${mm} mm deep`;
}

/** The view: canvas, camera, labels, buttons. */
class View {
  constructor(world) {
    this.world = world;
    this.canvas = document.getElementById('canvas');
    this.camera = new Camera();
    this.painter = Painter.on(this.canvas, world) || new Plan(this.canvas, world);
    this.painter.redraw = () => this.ask();
    this.now = { pose: null, frames: null, share: 0 };
    this.dark = matchMedia('(prefers-color-scheme: dark)');
    this.following = false;
    this.labels = world.labels.map((label) => {
      const span = document.createElement('span');
      span.textContent = label.text;
      span.classList.toggle('alert', Boolean(label.alert));
      span.classList.toggle('aside', Boolean(label.aside));
      document.getElementById('labels').append(span);
      return { ...label, span };
    });
    steer(this.canvas, this.camera, () => this.ask(), () => this.overview());
    for (const button of document.querySelectorAll('[data-view]')) {
      button.hidden = button.dataset.view === 'follow' && !world.rows;
      button.addEventListener('click', () => this.press(button));
    }
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    this.dark.addEventListener('change', () => this.ask());
    addEventListener('beforeprint', () => this.draw(PALETTES.light));
    addEventListener('afterprint', () => this.ask());
    this.resize();
    this.overview();
  }

  press(button) {
    const word = button.dataset.view;
    if (word === 'overview') this.overview();
    if (word === 'above') this.overview(Math.PI / 2 - 1e-3);
    if (word === 'closer') this.camera.zoom(0.8);
    if (word === 'farther') this.camera.zoom(1.25);
    if (word === 'follow') {
      this.following = !this.following;
      button.setAttribute('aria-pressed', String(this.following));
      if (this.following) this.lookAt(this.now.pose, 7 * this.world.reach);
      else this.overview();
    }
    this.ask();
  }

  /** Sees the whole motion, its longer side across the screen. */
  overview(tilt = 0.85) {
    const { low, high } = this.world;
    const tall = (high[1] - low[1]) > 1.2 * (high[0] - low[0]);
    Object.assign(this.camera, { tilt, turn: tall === (this.camera.aspect > 1) ? Math.PI / 2 : 0 });
    if (tilt < 1.5) this.camera.turn -= 0.32;
    const top = 0.5 * this.world.reach;
    this.camera.fit([0, top].flatMap((z) => [[low[0], low[1], z], [high[0], low[1], z], [low[0], high[1], z], [high[0], high[1], z]]));
    this.ask();
  }

  /** Looks at a place on the floor from nearby. */
  lookAt([x, y], distance) {
    this.camera.target = [x, y, 0.2];
    this.camera.distance = distance / Math.min(1, this.camera.aspect);
    this.ask();
  }

  /** Shows the robot at a pose, with a share of the way behind it. */
  show(pose, joints, share) {
    this.now = { pose, frames: shapeFrames(this.world.robot, pose, joints), share };
    if (this.following) this.camera.target = [pose[0], pose[1], 0.2];
    this.ask();
  }

  resize() {
    const { canvas } = this, ratio = Math.min(devicePixelRatio || 1, 2);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    const before = this.camera.aspect;
    this.camera.aspect = canvas.width / canvas.height;
    if ((before > 1) !== (this.camera.aspect > 1) || !this.fitted) this.overview();
    this.fitted = true;
    this.draw();
  }

  /** Draws with the next frame of the screen, once. */
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }

  draw(palette = this.dark.matches ? PALETTES.dark : PALETTES.light) {
    this.painter.draw(this.camera, palette, this.now);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    for (const { at, span, aside } of this.labels) {
      const [[x, y, w]] = this.camera.project([at]);
      const inside = w > 0 && Math.abs(x) < 0.97 && Math.abs(y) < 0.95;
      span.style.visibility = inside ? 'visible' : 'hidden';
      const left = Math.max(4, Math.min(0.5 * (1 + x) * width, width - span.offsetWidth - (aside ? 18 : 4)));
      span.style.transform = `translate(${left.toFixed(1)}px, ${(0.5 * (1 - y) * height).toFixed(1)}px) translate(${aside ? '14px, -50%' : '0, -130%'})`;
    }
  }
}

/** Slider, play button, figures at an instant, cursors in the charts, and links to instants. */
class Player {
  constructor(view, data) {
    Object.assign(this, { view, data, rows: view.world.rows, time: 0, playing: false });
    const find = (id) => document.getElementById(id);
    Object.assign(this, { slider: find('time'), button: find('play'), clock: find('clock'), rate: find('rate') });
    this.slider.step = String(Math.min(0.1, this.rows.step));
    this.slider.addEventListener('input', () => { this.halt(); this.go(this.slider.valueAsNumber); });
    this.button.addEventListener('click', () => (this.playing ? this.halt() : this.start()));
    const fits = [...this.rate.options].find((o) => this.rows.end / Number(o.value) <= 30 && Number(o.value) >= 1);
    this.rate.value = fits ? fits.value : '20';
    this.cursors = [...document.querySelectorAll('.now')].map((line) => ({ line, axis: line.dataset.axis.split(' ').map(Number) }));
    this.cursors.forEach(({ line }) => line.setAttribute('visibility', 'visible'));
    this.shown = [...document.querySelectorAll('[data-show]')].map((cell) => ({ cell, key: cell.dataset.show }));
    addEventListener('hashchange', () => this.follow(true));
    this.go(0);
    this.follow(false);
  }

  /** Goes where the address says: #t=12.5. */
  follow(scroll) {
    const time = /^#t=([\d.]+)$/.exec(location.hash);
    if (!time) return;
    this.halt();
    this.go(Number(time[1]));
    if (scroll) document.getElementById('view').scrollIntoView({ block: 'start' });
  }

  start() {
    if (this.time >= this.rows.end) this.go(0);
    this.mark(true);
    let before = null, due = 0;
    const calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
    const frame = (stamp) => {
      if (!this.playing) return;
      const passed = before === null ? 0 : Math.min(0.25, (stamp - before) / 1000);
      before = stamp;
      due += passed;
      if (!calm || due >= 1) { // who asked for less motion gets a picture a second
        this.go(this.time + due * Number(this.rate.value));
        due = 0;
      }
      if (this.time >= this.rows.end) this.halt();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  halt() {
    this.mark(false);
  }

  mark(playing) {
    this.playing = playing;
    this.button.toggleAttribute('data-on', playing);
    this.button.lastElementChild.textContent = playing ? 'Pause' : 'Play';
  }

  /** Shows an instant. */
  go(time) {
    const { rows, view, data } = this;
    this.time = Math.max(0, Math.min(rows.end, time));
    const state = stateAt(rows, this.time);
    view.show(state.pose, state.joints, rows.end > 0 ? this.time / rows.end : 0);
    this.slider.value = String(this.time);
    this.clock.textContent = `${this.time.toFixed(1)} s`;
    this.slider.setAttribute('aria-valuetext', `${this.time.toFixed(1)} seconds of ${rows.end.toFixed(1)}`);
    for (const { line, axis: [low, high, left, right] } of this.cursors) {
      const x = (left + ((right - left) * (this.time - low)) / (high - low)).toFixed(1);
      line.setAttribute('x1', x);
      line.setAttribute('x2', x);
    }
    const figures = this.figures(state, data);
    for (const { cell, key } of this.shown) cell.textContent = figures[key].replace(/-(?=[0.]+ )/g, '').replace(/-/g, '−');
  }

  /** What is written below the view. */
  figures(state, data) {
    const { rows } = this, { row, pose, joints } = state;
    const span = Math.max(1e-9, Math.min(rows.step, rows.end - row * rows.step));
    const next = Math.min(rows.count - 1, row + 1);
    const turn = next === row ? 0 : (rows.yaw[next] - rows.yaw[row]) / span;
    const degrees = ((((pose[2] * 180) / Math.PI) % 360) + 540) % 360 - 180;
    const out = {
      place: `${pose[0].toFixed(2)}, ${pose[1].toFixed(2)} m`,
      heading: `${degrees.toFixed(1)}°`,
      speed: `${(0.5 * (state.left + state.right)).toFixed(3)} m/s`,
      turn: `${turn.toFixed(3)} rad/s`,
      left: `${state.left.toFixed(3)} m/s`,
      right: `${state.right.toFixed(3)} m/s`,
    };
    joints.forEach((value, j) => { out[`joint${j}`] = `${value.toFixed(3)} ${data.robot.joints[j].prismatic ? 'm' : 'rad'}`; });
    if (data.clearance) {
      const { values, step, reach } = data.clearance;
      const value = values[Math.min(values.length - 1, Math.round(this.time / step))];
      out.clearance = value < -1e8 ? `> ${(1e3 * reach).toFixed(0)} mm` : `${(0.1 * value).toFixed(0)} mm`;
    }
    return out;
  }
}

/** Buttons that look at the places of a mission without a motion. */
function lookAround(view) {
  const bar = document.getElementById('places');
  if (!bar) return;
  const targets = view.world.places.map((p) => [p.name, p.pose]);
  if (view.world.gap) targets.push(['narrowest gap', view.world.gap.at]);
  for (const [name, at] of targets) {
    const button = document.createElement('button');
    button.type = 'button';
    button.textContent = name;
    button.addEventListener('click', () => view.lookAt(at, 6 * view.world.reach));
    bar.append(button);
  }
}

addEventListener('beforeprint', () => document.querySelectorAll('details').forEach((d) => { d.open = true; }));
const data = JSON.parse(document.getElementById('data').textContent);
if (data.robot && document.getElementById('canvas')) {
  const view = new View(readWorld(data));
  if (view.world.rows) new Player(view, data);
  else lookAround(view);
}
