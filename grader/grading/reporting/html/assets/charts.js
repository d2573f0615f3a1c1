// Draws the figures of kind "chart". All text is already harmless, and it is only ever set as text.
const Charts = (() => {
  const colour = (tone) => `var(--c-${tone})`;
  // The tones of data: each series of a chart has its own.
  const DATA = ["main", "second", "third", "fourth", "fifth", "sixth"];
  const SYMBOLS = { bad: "diamond", warning: "triangle", second: "rect", third: "triangle", fifth: "rect", sixth: "triangle" };
  const [SIDE, PANEL, LONE_PANEL, LANE, HEADER, AXIS, SLIDER, LABEL, GLYPH] = [52, 150, 190, 50, 34, 40, 26, 15, 6.4];
  const BANDS = { good: 0.38, warning: 0.18 };
  const FONT = { color: "var(--soft)", fontSize: 12, fontFamily: "inherit" };
  const TOOLTIP = {
    confine: true,
    transitionDuration: 0,
    backgroundColor: "var(--card)",
    borderColor: "var(--line)",
    textStyle: { color: "var(--ink)", fontSize: 13, fontFamily: "inherit" },
  };

  function number(value) {
    return value === null || value === undefined ? "none" : String(Number(Number(value).toPrecision(6)));
  }

  function withUnit(value, unit) {
    return unit ? `${number(value)} ${unit}` : number(value);
  }

  // Round ends and steps for an axis that shows everything from low to high.
  function niceAxis(low, high) {
    if (!(high > low)) {
      const room = Math.max(Math.abs(low) * 0.2, 0.1);
      [low, high] = [low - room, low + room];
    }
    const raw = (high - low) / 4;
    const power = 10 ** Math.floor(Math.log10(raw));
    const interval = [1, 2, 2.5, 5, 10].map((f) => f * power).find((step) => step >= raw * 0.999);
    const room = (high - low) * 0.04;
    const min = Math.floor((low - room) / interval) * interval;
    return {
      min: low >= 0 ? Math.max(min, 0) : min,
      max: Math.ceil((high + room) / interval) * interval,
      interval,
    };
  }

  function finite(values) {
    return values.filter((value) => value !== null && Number.isFinite(value));
  }

  function extent(values) {
    const known = finite(values);
    return known.length ? [known.reduce((a, b) => Math.min(a, b)), known.reduce((a, b) => Math.max(a, b))] : [0, 1];
  }

  function extentX(figure) {
    const points = figure.panels.flatMap((panel) => panel.series.flatMap((series) => series.points));
    const [low, high] = extent([...points.map((p) => p[0]), ...figure.moments.map((m) => m.x)]);
    if (figure.square) return [low, high];
    const last = Math.max(high, figure.until || 0);
    return [Math.min(0, low), last > 0 ? last * 1.01 : 1];
  }

  // The tone of each series by name: the one it asks for, unless another series of the chart has it.
  function tones(figure) {
    const given = new Map();
    for (const series of figure.panels.flatMap((panel) => panel.series)) {
      const key = `${series.name} ${series.tone}`;
      if (given.has(key)) continue;
      const free = DATA.filter((tone) => ![...given.values()].includes(tone));
      given.set(key, DATA.includes(series.tone) && !free.includes(series.tone) ? free[0] || series.tone : series.tone);
    }
    return (series) => given.get(`${series.name} ${series.tone}`);
  }

  function extentY(panel) {
    const values = panel.series.flatMap((series) => series.points.map((p) => p[1]));
    return extent([...values, ...panel.bands.flatMap((b) => [b.low, b.high]), ...panel.levels.map((l) => l.value)]);
  }

  // How far down each level's label has to move so that none lies on another: upwards where there is room, else downwards.
  function shifts(levels, axis, height) {
    const top = levels.map((level) => ((axis.max - level.value) / (axis.max - axis.min)) * height - LABEL);
    const order = [...levels.keys()].sort((a, b) => top[a] - top[b]);
    const wanted = top.map((place) => Math.min(place, height - LABEL));
    for (let k = order.length - 2; k >= 0; k -= 1) {
      wanted[order[k]] = Math.max(0, Math.min(wanted[order[k]], wanted[order[k + 1]] - LABEL));
    }
    for (let k = 1; k < order.length; k += 1) {
      wanted[order[k]] = Math.max(wanted[order[k]], wanted[order[k - 1]] + LABEL);
    }
    return wanted.map((place, index) => place - top[index]);
  }

  // What has a label above the chart: moments, then the first of neighbouring cases with the same label.
  // What is longer than the chart is cut; the words below it and the table have all of it.
  function labelled(figure, inner) {
    const most = Math.max(8, Math.floor(inner / GLYPH) - 2);
    const cut = (label) => (label.length > most ? `${label.slice(0, most - 1)}\u2026` : label);
    const first = figure.cases.filter(({ label, start }, k) => !k || figure.cases[k - 1].label !== label || figure.cases[k - 1].stop < start);
    const all = [...figure.moments, ...first.map(({ start, stop, label }) => ({ x: start, stop, label, tone: "" }))];
    return all.map((one) => ({ ...one, label: cut(one.label) }));
  }

  // The row of each label above the chart, so that none lies on another: faults first; null where both are full.
  function labelRows(figure, ends, width) {
    const inner = width - SIDE - 14;
    const taken = [[], []];
    const all = labelled(figure, inner);
    const rows = all.map(() => null);
    const rank = ({ tone, stop }) => (tone === "bad" ? 0 : stop === undefined ? 2 : 1);
    const order = [...rows.keys()].sort((a, b) => rank(all[a]) - rank(all[b]));
    for (const index of order) {
      const { x, label } = all[index];
      const long = label.length * GLYPH + 6;
      const at = ((x - ends[0]) / (ends[1] - ends[0])) * inner;
      const left = at - long * { left: 0, center: 0.5, right: 1 }[alignment(all[index], ends, inner)];
      const row = taken.findIndex((row) => row.every(([from, to]) => left >= to || left + long <= from));
      if (row < 0) continue;
      taken[row].push([left, left + long]);
      rows[index] = row;
    }
    return rows;
  }

  // Where each panel lies, from the top; heights in pixels.
  function places(figure, width, { slider, share }) {
    const rowsAbove = labelRows(figure, extentX(figure), width).filter((row) => row !== null);
    let top = rowsAbove.length ? 6 + LABEL * (1 + Math.max(...rowsAbove)) : 0;
    const rows = figure.panels.map((panel) => {
      const lone = figure.panels.length === 1;
      const height = panel.lanes.length ? panel.lanes.length * LANE : share * (lone ? LONE_PANEL : PANEL);
      top += panel.title ? HEADER : 8;
      const place = { top, height };
      top += height + 8;
      return place;
    });
    return { rows, height: top + AXIS + (slider ? SLIDER : 0) };
  }

  // Extents and height with which a metre is as long upwards as sideways.
  function squared(figure, width, share) {
    const inner = width - SIDE - 14;
    const [x, y] = [extentX(figure), extentY(figure.panels[0])];
    const [dx, dy] = [(x[1] - x[0]) * 1.12 || 1, (y[1] - y[0]) * 1.12 || 1];
    const height = Math.round(Math.min(Math.max((inner * dy) / dx, 240), Math.max(240, Math.min(inner, 460) * share)));
    const perPixel = Math.max(dx / inner, dy / height);
    const around = (ends, pixels) => {
      const middle = (ends[0] + ends[1]) / 2;
      return [middle - (perPixel * pixels) / 2, middle + (perPixel * pixels) / 2];
    };
    return { height, x: around(x, inner), y: around(y, height) };
  }

  function xAxis(figure, panel, index, ends) {
    const last = index === figure.panels.length - 1;
    return {
      type: "value",
      gridIndex: index,
      min: ends[0],
      max: ends[1],
      name: last ? `${figure.x.title} (${figure.x.unit})` : "",
      nameLocation: "middle",
      nameGap: 26,
      nameTextStyle: FONT,
      axisLabel: { show: last, ...FONT, hideOverlap: true, showMinLabel: !figure.square, showMaxLabel: false, formatter: number },
      axisLine: { show: true, onZero: false, lineStyle: { color: colour("axis") } },
      axisTick: { show: last, lineStyle: { color: colour("axis") } },
      splitLine: { show: !panel.grid, lineStyle: { color: colour("grid") } },
      axisPointer: { label: { show: false } },
    };
  }

  function rangeY(panel, ends) {
    return ends ? { min: ends[0], max: ends[1] } : niceAxis(...extentY(panel));
  }

  function yAxis(panel, index, ends) {
    const shared = {
      gridIndex: index,
      name: panel.unit ? `${panel.title} (${panel.unit})` : panel.title,
      nameLocation: "end",
      nameGap: 12,
      nameTextStyle: { ...FONT, align: "left", padding: [0, 0, 0, -SIDE + 8], fontWeight: 600 },
      axisLine: { show: false, onZero: false },
      axisTick: { show: false },
      axisPointer: { show: false },
      splitLine: { show: true, lineStyle: { color: colour("grid") } },
    };
    if (panel.lanes.length) {
      // The axis starts at the bottom, rows at the top; its name must stay above either way.
      const label = { ...FONT, inside: true, margin: 4, verticalAlign: "bottom", padding: [0, 0, 10, 0] };
      const data = [...panel.lanes].reverse();
      return { ...shared, type: "category", data, axisLabel: label, z: 4 };
    }
    const round = rangeY(panel, ends);
    const label = { ...FONT, formatter: number, showMinLabel: !ends, showMaxLabel: !ends };
    return { ...shared, type: "value", ...round, axisLabel: label };
  }

  function row(panel, y) {
    return panel.lanes.length && y !== null ? panel.lanes.length - 1 - y : y;
  }

  function seriesOption(panel, index, series, named) {
    const data = series.points.map(([x, y]) => [x, row(panel, y)]);
    const tone = colour(named);
    const common = {
      name: series.name,
      data,
      xAxisIndex: index,
      yAxisIndex: index,
      animation: false,
      emphasis: { disabled: true },
      itemStyle: { color: tone, opacity: 0.9 },
      symbol: SYMBOLS[named] || "circle",
      z: series.tone === "faint" ? 2 : 3,
    };
    if (series.look === "dots") {
      const size = data.length > 120 ? 5 : panel.lanes.length ? 9 : 7;
      return { ...common, type: "scatter", symbolSize: series.tone === "bad" ? size + 3 : size };
    }
    return {
      ...common,
      type: "line",
      step: series.look === "step" ? "end" : false,
      showSymbol: data.length < 70 && series.tone !== "faint",
      symbolSize: 5,
      lineStyle: { color: tone, width: series.tone === "faint" ? 3 : 2, type: "solid" },
    };
  }

  function gridLines(panel, ends) {
    const [first, distance] = panel.grid;
    const lines = [];
    for (let x = first; x <= ends[1] && lines.length < 500; x += distance) {
      lines.push({ xAxis: x, label: { show: false }, lineStyle: { color: colour("axis"), type: "solid", width: 1, opacity: 0.55 } });
    }
    return lines;
  }

  // Words at the edge of a chart stay inside it; those of a case begin with it.
  function alignment({ x, stop, label }, ends, inner) {
    const at = ((x - ends[0]) / (ends[1] - ends[0])) * inner;
    const long = label.length * GLYPH;
    const fits = { left: at + long <= inner, center: at >= long / 2 && at + long / 2 <= inner, right: at >= long };
    const wanted = stop === undefined ? ["center", "left", "right"] : ["left", "right", "center"];
    return wanted.find((one) => fits[one]) || "center";
  }

  // Bands, thresholds and moments: what is drawn behind the points.
  function background(figure, panel, index, ends, width, height, endsY) {
    const label = { ...FONT, fontSize: 11, textBorderColor: "var(--card)", textBorderWidth: 3 };
    const moved = shifts(panel.levels, rangeY(panel, endsY), height);
    const levels = panel.levels.map((level, at) => ({
      yAxis: level.value,
      lineStyle: { color: colour("faint"), type: "dashed", width: 2 },
      label: { ...label, show: true, position: "insideEndTop", offset: [0, moved[at]], formatter: () => level.label },
    }));
    const rows = labelRows(figure, ends, width);
    const moments = labelled(figure, width - SIDE - 14).map((moment, at) => ({
      xAxis: moment.x,
      lineStyle: { color: colour(moment.tone || "axis"), type: "dotted", width: moment.tone ? 1.5 : 0.5 },
      label: { ...label, show: index === 0 && rows[at] !== null, position: "end",
        distance: (panel.title ? 28 : 2) + LABEL * rows[at], formatter: () => moment.label,
        align: alignment(moment, ends, width - SIDE - 14) },
    }));
    const cases = figure.cases.map(({ start, stop, tone }, at) => [
      { xAxis: start, itemStyle: { color: colour(tone), opacity: at % 2 ? 0.07 : 0.15 } },
      { xAxis: stop },
    ]);
    const grid = panel.grid ? gridLines(panel, ends) : [];
    const bands = panel.bands.map((band) => [
      { yAxis: band.low, itemStyle: { color: colour("faint"), opacity: BANDS[band.tone] || 0.2 } },
      { yAxis: band.high },
    ]);
    return {
      type: "line",
      name: "",
      data: [],
      z: 1,
      xAxisIndex: index,
      yAxisIndex: index,
      silent: true,
      animation: false,
      markLine: { silent: true, symbol: "none", animation: false, data: [...grid, ...levels, ...moments] },
      markArea: { silent: true, animation: false, data: [...cases, ...bands] },
    };
  }

  // What holds at a moment counts there too, however long ago it was said.
  function holding(list, known) {
    const x = list[0].data[0];
    const named = new Set(list.map((one) => one.seriesIndex));
    return Object.entries(known).flatMap(([index, { panel, series }]) => {
      if (series.look !== "step" || panel.lanes.length || named.has(Number(index))) return [];
      const dataIndex = series.points.filter((point) => point[0] <= x).length - 1;
      return dataIndex < 0 ? [] : [{ seriesIndex: Number(index), dataIndex, data: series.points[dataIndex] }];
    });
  }

  function tooltip(figure, known, toneOf, said) {
    return (params) => {
      const list = (Array.isArray(params) ? params : [params]).filter((p) => known[p.seriesIndex]);
      if (list.length && !figure.square) list.push(...holding(list, known));
      const box = document.createElement("div");
      box.className = "tip";
      if (!list.length) return box;
      const add = (parent, tag, text, name) => {
        const element = parent.appendChild(document.createElement(tag));
        element.textContent = text;
        if (name) element.className = name;
        return element;
      };
      const x = list[0].data[0];
      const during = figure.cases.filter(({ start, stop }) => start <= x && x < stop).map(({ label }) => `, ${label}`).join("");
      const head = figure.square ? "" : `${figure.x.title} ${withUnit(x, figure.x.unit)}${during}`;
      if (head) add(box, "b", head);
      const words = [head];
      for (const one of list.slice(0, 8)) {
        const { panel, series } = known[one.seriesIndex];
        const line = add(box, "div", "", "row");
        add(line, "i", "").style.background = colour(toneOf(series));
        const value = figure.square
          ? `(${number(one.data[0])}, ${number(one.data[1])}) ${figure.x.unit}`
          : panel.lanes.length ? "" : withUnit(one.data[1], panel.unit);
        add(line, "span", value ? `${series.name}: ${value}` : series.name);
        const text = series.texts[one.dataIndex] || "";
        if (text) add(box, "div", text, "text");
        words.push(`${series.name} ${value} ${text}`.trim());
      }
      said(words.filter(Boolean).join("; "));
      return box;
    };
  }

  function zooms(figure, count, window, visible) {
    const all = [...Array(count).keys()];
    const inside = {
      type: "inside",
      xAxisIndex: all,
      filterMode: "none",
      zoomOnMouseWheel: "ctrl",
      moveOnMouseWheel: false,
      preventDefaultMouseMove: false,
      ...window,
    };
    if (figure.square) return [inside, { ...inside, xAxisIndex: undefined, yAxisIndex: all }];
    const slider = {
      type: "slider",
      xAxisIndex: all,
      filterMode: "none",
      height: 14,
      bottom: 6,
      left: SIDE,
      right: 14,
      showDetail: false,
      showDataShadow: false,
      brushSelect: false,
      borderColor: colour("grid"),
      fillerColor: "var(--accent-wash)",
      backgroundColor: "transparent",
      handleStyle: { color: "var(--card)", borderColor: colour("main") },
      moveHandleStyle: { color: colour("faint"), opacity: 0.5 },
      handleSize: 16,
      moveHandleSize: 4,
      ...window,
    };
    return visible ? [inside, slider] : [inside];
  }

  // How: whether there is a slider below, and the share of the usual height that panels have.
  function option(figure, width, window, said, { slider = !figure.square, share = 1 } = {}) {
    const square = figure.square ? squared(figure, width, share) : null;
    const place = places(figure, width, { slider, share });
    const toneOf = tones(figure);
    if (square) {
      place.height += square.height - place.rows[0].height;
      place.rows[0].height = square.height;
    }
    const ends = square ? square.x : extentX(figure);
    const series = [];
    const known = {};
    figure.panels.forEach((panel, index) => {
      series.push(background(figure, panel, index, ends, width, place.rows[index].height, square && square.y));
      for (const one of panel.series) {
        known[series.length] = { panel, series: one };
        series.push(seriesOption(panel, index, one, toneOf(one)));
      }
    });
    return {
      height: place.height,
      top: place.rows[0].top,
      bottom: place.rows.at(-1).top + place.rows.at(-1).height,
      known,
      option: {
        animation: false,
        textStyle: { fontFamily: "inherit" },
        grid: place.rows.map((r) => ({ left: SIDE, right: 14, top: r.top, height: r.height, outerBoundsMode: "none" })),
        xAxis: figure.panels.map((panel, index) => xAxis(figure, panel, index, ends)),
        yAxis: figure.panels.map((panel, index) => yAxis(panel, index, square && square.y)),
        axisPointer: { link: [{ xAxisIndex: "all" }], lineStyle: { color: colour("axis") } },
        dataZoom: zooms(figure, figure.panels.length, window, slider),
        tooltip: {
          trigger: figure.square ? "item" : "axis",
          axisPointer: { axis: "x" },
          ...TOOLTIP,
          formatter: tooltip(figure, known, toneOf, said),
        },
        series,
      },
    };
  }

  // Draws a figure into an element; returns what the page's buttons and keys do with it.
  // Charts over time with the same group share their cursor and their zoom.
  function draw(element, figure, said, group) {
    let chart = null;
    let known = {};
    let cursor = null;
    let area = null;
    let moment = null;
    let pointer = null;

    // Shows a moment of the run: a line at its time, or in a path the robot with its place and heading in radians.
    function at(place) {
      moment = place;
      if (!pointer && moment) {
        pointer = element.appendChild(document.createElement("div"));
        pointer.className = figure.square ? "robot" : "playhead";
        chart.on("datazoom", mark);
      }
      mark();
    }

    function mark() {
      if (!pointer) return;
      const ends = moment && chart.convertToPixel({ xAxisIndex: 0, yAxisIndex: 0 }, [moment.x, moment.y || 0]);
      pointer.hidden = !moment || ends[0] < SIDE - 1 || ends[0] > chart.getWidth() - 13;
      if (pointer.hidden) return;
      pointer.style.left = `${ends[0]}px`;
      pointer.style.top = `${figure.square ? ends[1] : area.top}px`;
      if (figure.square) pointer.style.transform = `rotate(${-moment.heading}rad)`;
      else pointer.style.height = `${area.bottom - area.top}px`;
    }

    function paint(width, how) {
      const window = chart ? shown() : { start: 0, end: 100 };
      const made = option(figure, width, window, said, how);
      known = made.known;
      area = made;
      element.style.height = `${made.height}px`;
      const size = { width, height: made.height };
      if (chart) chart.resize(size);
      else {
        chart = echarts.init(element, null, { renderer: "svg", ...size });
        if (group && figure.until) {
          chart.group = group;
          echarts.connect(group);
        }
      }
      chart.setOption(made.option, { notMerge: true });
      const picture = element.querySelector("svg");
      if (!picture) return;
      picture.setAttribute("aria-hidden", "true");
      picture.setAttribute("viewBox", `0 0 ${width} ${made.height}`);
      mark();
    }

    function shown() {
      const { start, end } = chart.getOption().dataZoom[0];
      return { start, end };
    }

    function show(start, end) {
      const span = Math.min(Math.max(end - start, 0.5), 100);
      const first = Math.min(Math.max(start, 0), 100 - span);
      chart.getOption().dataZoom.forEach((_, index) => {
        chart.dispatchAction({ type: "dataZoom", dataZoomIndex: index, start: first, end: first + span });
      });
    }

    function zoom(factor) {
      const { start, end } = shown();
      const [middle, half] = [(start + end) / 2, ((end - start) * factor) / 2];
      show(middle - half, middle + half);
    }

    function pan(share) {
      const { start, end } = shown();
      const way = (end - start) * share;
      show(start + way, end + way);
    }

    // Goes to the next or the previous point of the row with the most to say.
    function step(way) {
      const rows = Object.entries(known).filter(([, { series }]) => series.points.length);
      if (!rows.length) return;
      rows.sort(([, a], [, b]) => (a.series.tone === "faint") - (b.series.tone === "faint"));
      const [index, { series }] = rows[0];
      const count = series.points.length;
      cursor = cursor === null ? (way > 0 ? 0 : count - 1) : Math.min(Math.max(cursor + way, 0), count - 1);
      chart.dispatchAction({ type: "showTip", seriesIndex: Number(index), dataIndex: cursor });
    }

    function hide() {
      cursor = null;
      chart.dispatchAction({ type: "hideTip" });
    }

    // The library takes every turn of the wheel for itself; without ctrl it is the page's.
    for (const name of ["wheel", "mousewheel"]) {
      const pass = (event) => { if (!event.ctrlKey) event.stopPropagation(); };
      element.addEventListener(name, pass, { capture: true, passive: true });
    }
    paint(element.clientWidth || 640);
    return { zoom, pan, step, hide, paint, at, square: figure.square, reset: () => show(0, 100), width: () => element.clientWidth };
  }

  return { draw, tones, number, withUnit, colour, SYMBOLS, BANDS, FONT, TOOLTIP };
})();
