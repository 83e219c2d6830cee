// The replay: unpacks a recorded episode (see player.py) and draws any moment of it on a canvas.
"use strict";
(() => {
  const recorded = JSON.parse(document.getElementById("recorded").textContent);
  const at = (id) => document.getElementById(id);
  const stage = at("stage"), scrub = at("scrub"), play = at("play"), speed = at("speed");
  const context = stage.getContext("2d");
  const COLORS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7"];
  let shown = null; // the episode on stage, unpacked
  let moment = 0; // in steps, with fractions
  let running = 0, before = 0;

  async function unpack(episode) {
    const packed = Uint8Array.from(atob(episode.data), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const columns = JSON.parse(await new Response(stream).text());
    const shape = recorded.scenes[episode.scene];
    const pose = ([x, y, turn]) => ({ x, y, turn });
    const box = pose(columns.box), robots = columns.robots.map(pose);
    const talking = columns.silent.length;
    return { ...episode, ...columns, shape, box, robots, talking, bounds: bounds(episode, shape, box, robots) };
  }

  function bounds(episode, body, box, robots) {
    const xs = [episode.goal[0]], ys = [episode.goal[1]];
    for (const pose of [box, ...robots]) { xs.push(...pose.x); ys.push(...pose.y); }
    const margin = body.reach + 0.03;
    return [Math.min(...xs) - margin, Math.max(...xs) + margin, Math.min(...ys) - margin, Math.max(...ys) + margin];
  }

  // Between two steps lengths are drawn as if they grew evenly, turns the shorter way.
  function between(pose) {
    const t = Math.min(Math.floor(moment), shown.steps), u = Math.min(t + 1, shown.steps), part = moment - t;
    const mix = (column) => column[t] + part * (column[u] - column[t]);
    const turn = Math.atan2(Math.sin(pose.turn[u] - pose.turn[t]), Math.cos(pose.turn[u] - pose.turn[t]));
    return [mix(pose.x), mix(pose.y), pose.turn[t] + part * turn];
  }

  function draw() {
    if (!shown) return;
    const style = getComputedStyle(document.documentElement);
    const ink = (name) => style.getPropertyValue(`--${name}`).trim();
    const width = stage.clientWidth, [left, right, low, high] = shown.bounds;
    const height = Math.round(width * Math.min(0.9, Math.max(0.45, (high - low) / (right - left))));
    const dots = Math.min(devicePixelRatio || 1, 3);
    if (stage.width !== Math.round(width * dots) || stage.height !== Math.round(height * dots)) {
      stage.width = Math.round(width * dots);
      stage.height = Math.round(height * dots);
      stage.style.height = `${height}px`;
    }
    const scale = Math.min(width / (right - left), height / (high - low));
    const middle = [(left + right) / 2, (low + high) / 2];
    const world = () => context.setTransform(dots * scale, 0, 0, -dots * scale,
      dots * (width / 2 - scale * middle[0]), dots * (height / 2 + scale * middle[1]));
    const line = 1 / scale; // one pixel in meters
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, stage.width, stage.height);
    world();
    const within = (pose, paint) => {
      context.save();
      context.translate(pose[0], pose[1]);
      context.rotate(pose[2]);
      paint();
      context.restore();
    };
    grid(ink("grid"), width / scale, height / scale, middle, line);
    within(shown.goal, () => outline(() => {
      context.strokeStyle = ink("goal");
      context.lineWidth = 1.5 * line;
      context.setLineDash([6 * line, 4 * line]);
      context.stroke();
      context.setLineDash([]);
      ahead(ink("goal"), line);
    }));
    trail(shown.box, ink("box"), line);
    shown.robots.forEach((pose, r) => trail(pose, COLORS[r % COLORS.length], line));
    within(between(shown.box), () => outline(() => {
      context.globalAlpha = 0.75;
      context.fillStyle = ink("box");
      context.fill("evenodd");
      context.globalAlpha = 1;
      context.strokeStyle = ink("ink");
      context.lineWidth = line;
      context.stroke();
      ahead(ink("ink"), line);
    }));
    shown.robots.forEach((pose, r) => within(between(pose), () => robot(r, ink, line)));
    ruler(ink("soft"), dots, scale, height);
    tell();
  }

  function grid(color, wide, tall, middle, line) {
    context.strokeStyle = color;
    context.lineWidth = line;
    context.beginPath();
    const step = 0.25;
    for (let x = Math.ceil((middle[0] - wide / 2) / step) * step; x < middle[0] + wide / 2; x += step) {
      context.moveTo(x, middle[1] - tall / 2);
      context.lineTo(x, middle[1] + tall / 2);
    }
    for (let y = Math.ceil((middle[1] - tall / 2) / step) * step; y < middle[1] + tall / 2; y += step) {
      context.moveTo(middle[0] - wide / 2, y);
      context.lineTo(middle[0] + wide / 2, y);
    }
    context.stroke();
  }

  function outline(paint) {
    context.beginPath();
    for (const ring of shown.shape.rings) {
      ring.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.closePath();
    }
    paint();
  }

  // A tick from the center: which way the box looks.
  function ahead(color, line) {
    context.strokeStyle = color;
    context.lineWidth = 1.5 * line;
    context.beginPath();
    context.moveTo(0, 0);
    context.lineTo(0.45 * shown.shape.reach, 0);
    context.stroke();
  }

  function trail(pose, color, line) {
    const now = between(pose);
    context.beginPath();
    for (let t = 0; t <= moment; t++) context.lineTo(pose.x[t], pose.y[t]);
    context.lineTo(now[0], now[1]);
    context.strokeStyle = color;
    context.globalAlpha = 0.7;
    context.lineWidth = 1.2 * line;
    context.stroke();
    context.globalAlpha = 1;
  }

  function robot(r, ink, line) {
    const { radius, wheels } = shown.shape, color = COLORS[r % COLORS.length];
    const now = Math.round(moment);
    context.beginPath();
    context.arc(0, 0, radius, 0, 2 * Math.PI);
    context.fillStyle = context.strokeStyle = color;
    context.globalAlpha = shown.contact[r][now] ? 0.9 : 0.4;
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 1.5 * line;
    context.stroke();
    context.beginPath();
    context.moveTo(radius, 0);
    context.lineTo(0.4 * radius, 0.35 * radius);
    context.lineTo(0.4 * radius, -0.35 * radius);
    context.fillStyle = "#fff";
    context.fill();
    const each = shown.talking / shown.robots.length;
    if (shown.silent.slice(r * each, (r + 1) * each).some((column) => column[now])) {
      context.beginPath();
      context.arc(0, 0, 1.3 * radius, 0, 2 * Math.PI);
      context.strokeStyle = ink("failed");
      context.setLineDash([0.3 * radius, 0.2 * radius]);
      context.stroke();
      context.setLineDash([]);
    }
    wheels.forEach(([x, y], w) => {
      const agent = r * wheels.length + w, failed = shown.failed[agent][now];
      const fast = shown.speeds[agent][now] / shown.shape.speed;
      context.fillStyle = context.strokeStyle = failed ? ink("failed") : ink("wheel");
      context.fillRect(x - 0.25 * radius, y - 0.08 * radius, 0.5 * radius, 0.16 * radius);
      context.lineWidth = 1.5 * line;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + 1.2 * radius * fast, y);
      context.stroke();
      if (failed) {
        const arm = 0.3 * radius;
        context.lineWidth = 2.2 * line;
        context.beginPath();
        context.moveTo(x - arm, y - arm);
        context.lineTo(x + arm, y + arm);
        context.moveTo(x - arm, y + arm);
        context.lineTo(x + arm, y - arm);
        context.stroke();
      }
    });
  }

  function ruler(color, dots, scale, height) {
    context.setTransform(dots, 0, 0, dots, 0, 0);
    context.strokeStyle = context.fillStyle = color;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(12, height - 16);
    context.lineTo(12, height - 12);
    context.lineTo(12 + 0.25 * scale, height - 12);
    context.lineTo(12 + 0.25 * scale, height - 16);
    context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.fillText("25 cm", 14, height - 18);
  }

  function tell() {
    const now = Math.round(moment), [gx, gy, gt] = shown.goal, box = shown.box;
    const away = Math.hypot(box.x[now] - gx, box.y[now] - gy), turn = box.turn[now] - gt;
    const turned = Math.abs(Math.atan2(Math.sin(turn), Math.cos(turn))) * 180 / Math.PI;
    const failed = shown.shape.agents.filter((_, i) => shown.failed[i][now]);
    const names = shown.talking > shown.robots.length ? shown.shape.agents : shown.robots.map((_, r) => `robot${r + 1}`);
    const silent = names.filter((_, i) => shown.silent[i]?.[now] === 1);
    const absent = names.filter((_, i) => shown.silent[i]?.[now] === 2);
    const end = now < shown.steps ? "" : shown.reached ? " – goal reached" : " – goal not reached";
    const text = `step ${now} of ${shown.steps}, ${(now * shown.dt).toFixed(1)} s: box ${(100 * away).toFixed(0)} cm ` +
      `from the goal, turned ${turned.toFixed(0)}°${failed.length ? `; failed: ${failed.join(", ")}` : ""}` +
      `${silent.length ? `; messages fail: ${silent.join(", ")}` : ""}` +
      `${absent.length ? `; absent: ${absent.join(", ")}` : ""}${end}`;
    at("moment").textContent = text;
    scrub.setAttribute("aria-valuetext", text);
  }

  function go(to) {
    moment = Math.min(Math.max(to, 0), shown.steps);
    scrub.value = moment;
    draw();
  }

  function pause() {
    cancelAnimationFrame(running);
    running = 0;
    play.textContent = "Play";
  }

  function tick(time) {
    go(moment + (time - before) / 1000 * Number(speed.value) / shown.dt);
    before = time;
    if (moment >= shown.steps) pause();
    else running = requestAnimationFrame(tick);
  }

  function toggle() {
    if (!shown) return;
    if (running) return pause();
    if (moment >= shown.steps) go(0);
    play.textContent = "Pause";
    before = performance.now();
    running = requestAnimationFrame(tick);
  }

  function options(select, values, text = String) {
    const old = select.value;
    select.replaceChildren(...values.map((value) => new Option(text(value), value)));
    if (values.map(String).includes(old)) select.value = old;
  }

  const chosen = (...fields) => recorded.episodes.filter((e) => fields.every((f) => String(e[f]) === at(f === "number" ? "episode" : f).value));
  const distinct = (episodes, field) => [...new Set(episodes.map((e) => e[field]))];

  async function choose() {
    pause();
    options(at("seed"), distinct(chosen("condition"), "seed"));
    const numbers = distinct(chosen("condition", "seed"), "number");
    const places = new Map([[numbers[0], " (first)"], [numbers.at(-1), numbers.length > 1 ? " (last)" : ""]]);
    options(at("episode"), numbers, (n) => `${n}${places.get(n) ?? ""}`);
    shown = await unpack(chosen("condition", "seed", "number")[0]);
    scrub.max = shown.steps;
    at("which").textContent = `${shown.condition}, seed ${shown.seed}, training episode ${shown.number}`;
    legend();
    go(0);
  }

  function legend() {
    const mark = (look, text) => {
      const item = document.createElement("span"), sign = document.createElement("i");
      if (look.startsWith("#") || look.startsWith("var")) sign.style.background = look;
      else sign.className = look;
      if (look.startsWith("var")) sign.className = "square";
      item.append(sign, text);
      return item;
    };
    const robots = shown.robots.slice(0, COLORS.length).map((_, r) => mark(COLORS[r], `robot ${r + 1}`));
    at("legend").replaceChildren(...robots, mark("var(--box)", "box"), mark("dashed", "goal"),
      "pale: no contact; line at a wheel: its speed; red cross: failed wheel" +
      (shown.talking ? "; dashed ring: its messages fail" : ""));
  }

  scrub.addEventListener("input", () => { pause(); go(Number(scrub.value)); });
  play.addEventListener("click", toggle);
  stage.addEventListener("click", toggle);
  for (const id of ["condition", "seed", "episode"]) at(id).addEventListener("change", choose);
  for (const part of [stage, scrub]) {
    part.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
      if (event.key === " ") toggle();
      else if (step) { pause(); go(Math.round(moment) + step); }
      else if (event.key === "Home") { pause(); go(0); }
      else if (event.key === "End") { pause(); go(shown.steps); }
      else return;
      event.preventDefault();
    });
  }
  new ResizeObserver(draw).observe(stage);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  // On paper the whole episode is worth more than its start.
  let kept = 0;
  addEventListener("beforeprint", () => { kept = moment; if (shown && !moment) go(shown.steps); else draw(); });
  addEventListener("afterprint", () => { if (shown) go(kept); });

  if (!("DecompressionStream" in window)) return;
  at("unplayed").hidden = true;
  at("player").hidden = false;
  options(at("condition"), distinct(recorded.episodes, "condition"));
  options(at("seed"), distinct(chosen("condition"), "seed"));
  options(at("episode"), distinct(chosen("condition", "seed"), "number"));
  at("episode").selectedIndex = at("episode").options.length - 1;
  choose();
})();
