// The world from above, on a plain canvas: for browsers without WebGL.

/** Draws a world from above; the same use as `Painter`. */
class Plan {
  constructor(canvas, world) {
    Object.assign(this, { canvas, world, paper: canvas.getContext('2d') });
  }

  draw(camera, palette, now) {
    const { paper, world, canvas } = this;
    camera.tilt = Math.PI / 2 - 1e-3;
    const at = (p) => {
      const [[x, y]] = camera.project([[p[0], p[1], 0]]);
      return [0.5 * (1 + x) * canvas.width, 0.5 * (1 - y) * canvas.height];
    };
    const line = (points, closed) => {
      paper.beginPath();
      points.forEach((p, i) => paper[i ? 'lineTo' : 'moveTo'](...at(p)));
      if (closed) paper.closePath();
    };
    const fill = (points, colour, opacity = 1) => {
      paper.globalAlpha = opacity;
      paper.fillStyle = colour;
      line(points, true);
      paper.fill();
      paper.globalAlpha = 1;
    };
    const stroke = (points, colour, width, closed = false) => {
      paper.strokeStyle = colour;
      paper.lineWidth = width * devicePixelRatio;
      line(points, closed);
      paper.stroke();
    };
    const rectangle = (low, high) => [low, [high[0], low[1]], high, [low[0], high[1]]];
    const shadow = (frames, opacity, link) => world.robot.shapes.forEach((shape, s) => {
      if (!frames[s]) return;
      const outline = outlineOf(shape.points.map((p) => carry(frames[s], p)));
      const colour = link && shape.link === link ? palette.alert : shape.moved ? palette.moved : palette.base;
      fill(outline, colour, opacity);
      stroke(outline, palette.edge, 0.8, true);
    });
    paper.fillStyle = palette.stage;
    paper.fillRect(0, 0, canvas.width, canvas.height);
    fill(rectangle(world.floor.low, world.floor.high), palette.floor);
    (world.tint || []).forEach((outline) => fill(outline, palette.base, 0.02));
    for (const [x, y, , dx, dy] of world.boxes || []) {
      const low = [world.map.origin[0] + world.map.cell * x, world.map.origin[1] + world.map.cell * y];
      fill(rectangle(low, [low[0] + world.map.cell * dx, low[1] + world.map.cell * dy]), palette.obstacle);
    }
    world.zones.forEach((zone) => stroke(zone, palette.moved, 1.5));
    if (world.way) {
      const k = Math.round(now.share * (world.way.length - 1));
      stroke(world.way.slice(k), palette.ahead, 2);
      stroke(world.way.slice(0, k + 1), palette.driven, 2.5);
    }
    world.ghosts.forEach(({ frames }) => shadow(frames, 0.05));
    world.places.forEach((place) => shadow(place.frames, 0.25, place.link));
    if (now.frames) shadow(now.frames, 0.85);
    for (const { at: p, radius } of world.rings) {
      const points = Array.from({ length: 48 }, (_, k) => [p[0] + radius * Math.cos(k * Math.PI / 24), p[1] + radius * Math.sin(k * Math.PI / 24)]);
      stroke(points, palette.alert, 1.5, true);
    }
  }
}
