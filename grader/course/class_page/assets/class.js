// Brings the page of a class to life: the chart of scores, and a table to sort and to search. Text is only ever set as text.
(() => {
  const data = JSON.parse(document.getElementById("class").textContent);
  const byId = (id) => document.getElementById(id);
  const form = byId("filters");
  const table = byId("table");
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const LETTERS = { met: "m", partly: "p", not_met: "n", blocked: "b", undecided: "u", lost: "np" };
  const PRINTED_WIDTH = 660;

  // ---- order
  const collator = new Intl.Collator("en", { numeric: true, sensitivity: "base" });
  const order = (values) => {
    const sorted = [...values.keys()].sort((a, b) => collator.compare(values[a], values[b]) || a - b);
    const place = new Array(values.length);
    let rank = -1;
    sorted.forEach((index, k) => {
      if (!k || collator.compare(values[index], values[sorted[k - 1]])) rank += 1;
      place[index] = rank;
    });
    return place;
  };
  const names = order(data.students.map((student) => student.name));
  const keys = {
    surname: () => [...rows.keys()], // the order of the rows as written, which the pages of students follow too
    name: () => names,
    status: () => order(data.students.map((student) => student.status)),
    raw: () => data.students.map((student) => student.raw),
    change: () => data.students.map((student) => student.change),
    final: () => data.students.map((student) => student.final),
    exercise: (head) => data.students.map((student) => student.exercises[Number(head.dataset.index)]),
  };

  // ---- rows: of a large class only the first are laid out, more when they are wanted
  const AT_ONCE = 200;
  const more = byId("more");
  let sorted = [...rows.keys()];
  let fitting = rows.map(() => true);
  let wanted = [];
  let limit = AT_ONCE;

  function show(most = AT_ONCE) {
    const before = limit === most ? wanted : [];
    limit = most;
    wanted = sorted.filter((index) => fitting[index]);
    if (wanted.length === before.length && wanted.every((index, k) => index === before[k])) return;
    body.replaceChildren(...wanted.slice(0, limit).map((index) => rows[index]));
    count();
  }

  function extend() {
    body.append(...wanted.slice(limit, limit + AT_ONCE).map((index) => rows[index]));
    limit += AT_ONCE;
    count();
  }

  function count() {
    const left = wanted.length - limit;
    more.hidden = !(left > 0);
    more.textContent = `Show more rows (${left} left)`;
    table.setAttribute("aria-rowcount", String(wanted.length + 1));
  }

  more.addEventListener("click", extend);
  new IntersectionObserver((seen) => { if (seen.some((one) => one.isIntersecting) && !more.hidden) extend(); }).observe(more);
  window.addEventListener("beforeprint", () => show(rows.length));
  window.addEventListener("afterprint", () => show());

  // Rows without a value come last, whichever way the others go; equal ones stay in the order of surnames.
  function sort(head, descending, key = head.dataset.sort) {
    const values = keys[key](head);
    const way = descending ? -1 : 1;
    sorted = [...rows.keys()].sort((a, b) => {
      if (values[a] === null || values[b] === null) return (values[a] === null) - (values[b] === null) || a - b;
      return way * (values[a] - values[b]) || a - b;
    });
    for (const other of table.tHead.querySelectorAll("th[data-sort]")) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", descending ? "descending" : "ascending");
    const chosen = key === "final" && !descending ? "final up" : key;
    const listed = [...byId("sort").options].some((option) => option.value === chosen);
    const standard = descending === (chosen === "final");
    byId("sort").value = listed && standard ? chosen : "";
    show();
  }

  const headOf = (key) => table.tHead.querySelector(`th[data-sort=${key === "name" ? "surname" : key}]`);
  byId("sort").addEventListener("input", (event) => {
    event.stopPropagation(); // it filters nothing
    const [key, up] = byId("sort").value.split(" ");
    sort(headOf(key), key === "final" && !up, key);
  });

  for (const head of table.tHead.querySelectorAll("th[data-sort]")) {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const before = head.getAttribute("aria-sort");
      const numbers = head.dataset.sort !== "surname" && head.dataset.sort !== "status";
      sort(head, before ? before === "ascending" : numbers && head.dataset.sort !== "change");
    });
  }

  // ---- filters
  const plain = (text) => text.normalize("NFKD").replace(/\p{M}/gu, "").toLowerCase();
  let texts = null; // made when somebody searches for the first time
  let cause = null;

  function matching() {
    const words = plain(byId("search").value).split(/\s+/).filter(Boolean);
    if (words.length && !texts) texts = rows.map((row) => plain(row.textContent));
    const criterion = data.criteria.indexOf(byId("criterion").value);
    const outcome = LETTERS[byId("outcome").value] || "";
    const status = byId("status").value;
    const [least, most] = [byId("least").value, byId("most").value];
    const inCause = cause === null ? null : new Set(data.causes[cause]);
    return (student, index) => {
      if (inCause && !inCause.has(index)) return false;
      if (status && student.status !== status) return false;
      const letters = criterion < 0 ? student.outcomes : student.outcomes[criterion];
      if (outcome && ![...letters].some((letter) => outcome.includes(letter))) return false;
      if (!outcome && criterion >= 0 && letters === "-") return false;
      if (least !== "" && !(student.final !== null && student.final >= Number(least))) return false;
      if (most !== "" && !(student.final !== null && student.final <= Number(most))) return false;
      return words.every((word) => texts[index].includes(word));
    };
  }

  function filter() {
    fitting = data.students.map(matching());
    show();
    const which = cause === null ? "" : ` with cause ${cause + 1}`;
    const all = wanted.length === rows.length;
    const total = `${rows.length} ${rows.length === 1 ? "row" : "rows"}`;
    byId("shown").textContent = all ? total : `${wanted.length} of ${total}${which}`;
  }

  function clear() {
    const order = byId("sort").value;
    form.reset();
    byId("sort").value = order;
    cause = null;
  }

  function only(change) {
    clear();
    change();
    filter();
    byId("students").scrollIntoView();
    byId("shown").setAttribute("tabindex", "-1");
    byId("shown").focus({ preventScroll: true });
  }

  form.hidden = false;
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("input", () => filter());
  byId("all").addEventListener("click", () => { clear(); filter(); });
  // What is wanted of a criterion is nearly always who failed it.
  byId("criterion").addEventListener("input", () => {
    if (byId("criterion").value && !byId("outcome").value) byId("outcome").value = "lost";
  });
  for (const button of document.querySelectorAll("button[data-criterion]")) {
    button.addEventListener("click", () => only(() => {
      byId("criterion").value = button.dataset.criterion;
      byId("outcome").value = button.dataset.outcome;
    }));
  }
  for (const button of document.querySelectorAll("button[data-cause]")) {
    button.addEventListener("click", () => only(() => { cause = Number(button.dataset.cause); }));
  }

  // ---- chart
  const figure = document.querySelector("[data-figure=scores]");
  const { FONT } = Charts;
  let chart = null;
  let pointed = -1;

  const words = (bin) => `${bin[0]}: ${bin[3]} as graded${data.changed ? `, ${bin[4]} after adjustments` : ""}`;

  function tip(params) {
    const box = document.createElement("div");
    box.className = "tip";
    box.textContent = words(data.bins[params[0].dataIndex]);
    return box;
  }

  function bars(name, column, tone, labelled) {
    return {
      name,
      type: "bar",
      data: data.bins.map((bin) => bin[column]),
      itemStyle: { color: Charts.colour(tone), borderRadius: [3, 3, 0, 0] },
      label: { show: labelled, position: "top", ...FONT, formatter: ({ value }) => (value ? String(value) : "") },
      barGap: "8%",
      barCategoryGap: "18%",
      animation: false,
      emphasis: { disabled: true },
    };
  }

  function paint(width) {
    const drawing = figure.querySelector(".drawing");
    const height = 260;
    drawing.style.height = `${height}px`;
    if (chart) chart.resize({ width, height });
    else chart = echarts.init(drawing, null, { renderer: "svg", width, height });
    const narrow = width < 560;
    const short = (label) => (narrow ? label.replace(/ to .*/, "") : label);
    // The axis ends above the highest bar, so it may have a digit more.
    const most = Math.max(0, ...data.bins.flatMap((bin) => bin.slice(3, 5)));
    const digits = String(Math.ceil(most * 1.2)).length;
    chart.setOption({
      animation: false,
      grid: { left: Math.max(36, 12 + 8 * digits), right: 8, top: 20, bottom: 44, outerBoundsMode: "none" },
      xAxis: {
        type: "category",
        data: data.bins.map((bin) => short(bin[0])),
        name: narrow ? "percent of the points, at least" : "percent of the points",
        nameLocation: "middle",
        nameGap: 28,
        nameTextStyle: FONT,
        axisLabel: { ...FONT, interval: 0, hideOverlap: false, overflow: "none", fontSize: narrow ? 10 : 12, formatter: (text) => text.replace(" %", "") },
        axisLine: { lineStyle: { color: Charts.colour("axis") } },
        axisTick: { show: false },
      },
      yAxis: {
        type: "value",
        minInterval: 1,
        axisLabel: { ...FONT, formatter: String },
        splitLine: { lineStyle: { color: Charts.colour("grid") } },
      },
      tooltip: {
        trigger: "axis",
        axisPointer: { type: "shadow" },
        ...Charts.TOOLTIP,
        formatter: tip,
      },
      series: [
        bars("as graded", 3, "main", !narrow || !data.changed),
        ...(data.changed ? [bars("after adjustments", 4, "second", !narrow)] : []),
      ],
    }, { notMerge: true });
    const picture = drawing.querySelector("svg");
    if (picture) picture.setAttribute("aria-hidden", "true");
  }

  // Shows the students of a bar; their final scores decide.
  function pick(index) {
    const [, low, high] = data.bins[index];
    only(() => {
      byId("least").value = String(low * data.max_score);
      if (index < data.bins.length - 1) byId("most").value = String(Math.max(0, high * data.max_score - 0.01));
    });
  }

  function walk(way) {
    pointed = Math.min(Math.max(pointed + way, 0), data.bins.length - 1);
    chart.dispatchAction({ type: "showTip", seriesIndex: 0, dataIndex: pointed });
    figure.querySelector("[data-said]").textContent = words(data.bins[pointed]);
  }

  function draw() {
    const drawing = figure.querySelector(".drawing");
    let width = drawing.clientWidth || 640;
    paint(width);
    chart.on("click", (event) => pick(event.dataIndex));
    const acts = { ArrowRight: () => walk(1), ArrowLeft: () => walk(-1), Enter: () => pointed >= 0 && pick(pointed) };
    drawing.addEventListener("keydown", (event) => {
      if (!acts[event.key]) return;
      event.preventDefault();
      acts[event.key]();
    });
    let printing = false;
    new ResizeObserver(() => {
      if (printing || !drawing.clientWidth || drawing.clientWidth === width) return;
      width = drawing.clientWidth;
      paint(width);
    }).observe(drawing);
    window.addEventListener("beforeprint", () => { printing = true; paint(PRINTED_WIDTH); });
    window.addEventListener("afterprint", () => { printing = false; paint(width); });
  }

  sort(headOf("surname"), false);
  if (figure) draw();
  document.documentElement.dataset.ready = "yes";
})();
