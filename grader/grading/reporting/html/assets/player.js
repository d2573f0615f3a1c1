// Plays a recording: a slider over its time, and what was published, logged and connected at that moment.
const Player = (() => {
  const SPEEDS = [1, 2, 5, 10];
  // A topic counts as busy for so long after a message, in seconds.
  const BUSY = 0.15;
  const ODOMETRY = "nav_msgs/msg/Odometry";
  const POSE = ["position.x", "position.y", "orientation.z", "orientation.w"].map((name) => `pose.pose.${name}`);

  function add(parent, tag, text = "", name = "") {
    const element = parent.appendChild(document.createElement(tag));
    element.textContent = text;
    if (name) element.className = name;
    return element;
  }

  // The index of the last time that is not after t; -1 if all are.
  function last(times, t) {
    let [low, high] = [0, times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  function valueOf(field, index) {
    return field.values.length === 1 ? field.values[0] : field.values[index];
  }

  // The place and the heading of the robot by index of its messages; null without odometry.
  function poses(topics) {
    const topic = topics.find((one) => one.type === ODOMETRY);
    const fields = topic && POSE.map((name) => topic.fields.find((field) => field.name === name));
    if (!topic || !fields[0] || !fields[1]) return null;
    return {
      topic,
      at: (index) => {
        const [x, y, z, w] = fields.map((field) => (field ? valueOf(field, index) : 0));
        return x === null || y === null ? null : { x, y, heading: 2 * Math.atan2(z, w) };
      },
    };
  }

  function drawPath(element, robot) {
    const points = robot.topic.times.map((_, index) => robot.at(index)).filter(Boolean).map(({ x, y }) => [x, y]);
    const series = [{ name: `path on ${robot.topic.name}`, points, look: "line", tone: "faint", texts: [] }];
    const panel = { title: "y", unit: "m", series, bands: [], levels: [], lanes: [], grid: null };
    const figure = { square: true, panels: [panel], moments: [], cases: [], x: { title: "x", unit: "m" } };
    return Charts.draw(add(element, "div", "", "drawing"), figure, () => {});
  }

  // Everything that was written, called or raised, in order; the timeline has it in rows.
  function lines(timeline) {
    const [{ lanes, series }] = timeline.panels;
    const found = series.flatMap(({ name, tone, points, texts }) =>
      points.map(([t, lane], index) => ({ t, tone, said: `${lanes[lane].replace(/: \w+$/, "")} ${name}`, text: texts[index] })));
    return found.sort((a, b) => a.t - b.t);
  }

  function openLog(element, timeline) {
    const list = element.querySelector("ol");
    const all = lines(timeline);
    const items = all.map(({ t, tone, said, text }) => {
      const item = add(list, "li", "", tone);
      item.hidden = true;
      add(item, "i", `${t.toFixed(3)} ${said} `);
      item.append(text);
      return item;
    });
    const times = all.map(({ t }) => t);
    let shown = 0;
    if (!items.length) add(list, "li", "Nothing was logged or printed.");
    return (t) => {
      const wanted = last(times, t) + 1;
      if (wanted === shown) return;
      for (let k = Math.min(shown, wanted); k < Math.max(shown, wanted); k += 1) items[k].hidden = k >= wanted;
      shown = wanted;
      element.scrollTop = element.scrollHeight;
    };
  }

  function openValues(element, topics) {
    if (!topics.length) add(element, "p", "Nothing was published.");
    const rows = topics.map((topic) => {
      const row = add(element, "div");
      const head = add(row, "p");
      add(head, "b", topic.name);
      head.append(` ${topic.type}, from the ${topic.sender}`);
      const when = add(head, "i");
      const list = add(row, "ul");
      const cells = topic.fields.map((field) => {
        const item = add(list, "li");
        add(item, "i", `${field.name} `);
        return add(item, "span");
      });
      return { topic, row, when, cells, index: null };
    });
    return (t) => {
      for (const one of rows) {
        const { topic, row, when, cells } = one;
        const index = last(topic.times, t);
        row.className = index >= 0 && t - topic.times[index] <= BUSY ? "busy" : "";
        if (index === one.index) continue;
        one.index = index;
        when.textContent = index < 0 ? ": nothing yet" : ` at ${topic.times[index]} s`;
        topic.fields.forEach((field, k) => {
          const value = index < 0 ? "" : valueOf(field, index);
          cells[k].textContent = typeof value === "string" ? value : Charts.number(value);
        });
      }
    };
  }

  function openGraph(element, graph) {
    if (!graph.nodes.length) return { at: () => {}, paint: () => {} };
    return Graphs.live(element, graph, () => {});
  }

  function controls(parent, length) {
    const button = add(parent, "button", "\u25b6 Play");
    button.type = "button";
    const slider = add(parent, "input");
    Object.assign(slider, { type: "range", min: 0, max: length, step: length / 500, value: length });
    slider.setAttribute("aria-label", "Time in the run");
    const clock = add(parent, "output");
    const speed = add(parent, "select");
    speed.setAttribute("aria-label", "Speed");
    for (const factor of SPEEDS) add(speed, "option", `${factor}\u00d7`).value = factor;
    return { button, slider, clock, speed };
  }

  // Fills the player of a run. Every moment is also passed on: its time as x, and the pose of the robot, if it has one.
  function open(element, run, follow) {
    const length = run.timeline.until;
    const part = (name) => element.querySelector(`.moment .${name}`);
    const { button, slider, clock, speed } = controls(element.querySelector(".player"), length);
    const robot = poses(run.topics);
    const path = robot && drawPath(part("path"), robot);
    const graph = openGraph(part("live"), run.graph);
    const parts = [openLog(part("log"), run.timeline), openValues(part("values"), run.topics)];
    let now = length;
    let before = null;

    function show(t) {
      now = Math.min(Math.max(t, 0), length);
      slider.value = now;
      clock.textContent = `${now.toFixed(2)} s`;
      slider.setAttribute("aria-valuetext", `${now.toFixed(2)} of ${length.toFixed(2)} seconds`);
      for (const part of parts) part(now);
      const busy = run.topics.filter(({ times }) => now - times[last(times, now)] <= BUSY);
      graph.at(last(run.graph.times, now), new Set(busy.map(({ name }) => name)));
      const index = robot ? last(robot.topic.times, now) : -1;
      const pose = index < 0 ? null : robot.at(index);
      if (path) path.at(pose);
      return { x: now, pose };
    }

    function play(on) {
      if (on && now >= length) follow(show(0));
      before = on ? performance.now() : null;
      button.textContent = on ? "\u23f8 Pause" : "\u25b6 Play";
      if (on) requestAnimationFrame(frame);
    }

    function frame(instant) {
      if (before === null) return;
      follow(show(now + (Math.max(instant - before, 0) / 1000) * speed.value));
      before = instant;
      if (now < length) requestAnimationFrame(frame);
      else play(false);
    }

    button.addEventListener("click", () => play(before === null));
    slider.addEventListener("input", () => follow(show(Number(slider.value))));
    slider.addEventListener("keydown", (event) => {
      if (event.key !== " ") return;
      event.preventDefault();
      play(before === null);
    });
    new ResizeObserver(() => {
      if (!element.clientWidth || element.closest("details:not([open])")) return;
      if (path) path.paint(path.width());
      graph.paint();
      show(now);
    }).observe(element);
    show(length);
  }

  return { open };
})();
