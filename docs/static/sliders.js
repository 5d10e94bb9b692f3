// Sliders and curves of a law. The page defines `about` and the functions steady, loop and belt; see docs/machine/sliders.py.
(() => {
  'use strict';
  const root = document.querySelector('.sliders');
  const groups = { law: 'Parameters of the law', inputs: 'Further inputs', contact: 'Load and motion', belt: 'Block on the belt' };
  const all = Object.keys(groups).flatMap(group => about[group].map(item => ({ ...item, group })));
  /** True for an item that changes a curve of this page. */
  const moves = item => item.group === 'belt' ? about.runs.belt : about.runs.loop || !['A', 'f'].includes(item.name);
  const values = new Map(all.map(item => [item.group + item.name, item.value]));
  const of = group => about[group].map(item => values.get(group + item.name));
  const length = about.turning ? 'rad' : 'm', force = about.turning ? 'N m' : 'N';
  const unitOf = item => !about.turning || item.group === 'law' ? item.unit
    : ({ m: item.name === 'A' ? 'rad' : 'm', N: item.name === 'N' ? 'N' : item.unit })[item.unit] ?? item.unit;

  const make = (name, attributes = {}, ...inside) => {
    const svg = ['svg', 'path', 'text', 'g'].includes(name);
    const node = svg ? document.createElementNS('http://www.w3.org/2000/svg', name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...inside);
    return node;
  };
  const digits = (value, count = 3) => {
    if (!Number.isFinite(value)) return String(value);
    const size = Math.abs(value);
    return size === 0 || (size >= 1e-3 && size < 1e5) ? String(Number(value.toPrecision(count)))
      : value.toExponential(count - 1).replace(/\.?0+e/, 'e').replace('e+', 'e');
  };

  // ---- curves ----

  const PREFIXES = [[1e6, 'M'], [1e3, 'k'], [1, ''], [1e-3, 'm'], [1e-6, 'µ'], [1e-9, 'n'], [1e-12, 'p']];
  const readable = (unit, top) => {
    if (!(top > 0) || unit.includes('^')) return [1, unit];
    const [size, letter] = PREFIXES.find(([size]) => top >= 0.5 * size) ?? PREFIXES[6];
    return [size, letter + unit];
  };
  const extent = rows => {
    let low = Infinity, high = -Infinity;
    for (const row of rows) for (const value of row)
      if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
    return low <= high ? [low, high] : [0, 0];
  };
  const padded = ([low, high]) => {
    const room = 0.05 * (high - low) || 0.1 * Math.abs(high) || 1;
    return [low - room, high + room];
  };
  const ticks = ([low, high], count) => {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map(k => k * power).find(s => s >= 0.7 * raw);
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high; k += 1) found.push(k * step);
    return found;
  };

  /** Draw curves (x, y; the last one is solid) with axes, and say in words what they show. */
  const draw = (figure, x, y, curves) => {
    const width = Math.round(figure.svg.getBoundingClientRect().width) || 380;
    const height = 260, left = 58, bottom = 42, top = 10, right = 12;
    const [sizeX, unitX] = readable(x.unit, Math.max(...extent(curves.map(c => c.x)).map(Math.abs)));
    const [sizeY, unitY] = readable(y.unit, Math.max(...extent(curves.map(c => c.y)).map(Math.abs)));
    const rangeX = extent(curves.map(c => c.x)).map(v => v / sizeX);
    const rangeY = padded(extent(curves.map(c => c.y)).map(v => v / sizeY));
    const [lowX, highX] = figure.tight ? rangeX : padded(rangeX);
    const placeX = v => left + (v - lowX) / (highX - lowX) * (width - left - right);
    const placeY = v => height - bottom - (v - rangeY[0]) / (rangeY[1] - rangeY[0]) * (height - top - bottom);
    const nodes = [];
    const lines = { grid: '', zero: '' };
    for (const v of ticks([lowX, highX], width / 70)) {
      lines[v === 0 ? 'zero' : 'grid'] += `M${placeX(v).toFixed(1)} ${top}V${height - bottom}`;
      nodes.push(make('text', { x: placeX(v), y: height - bottom + 15, 'text-anchor': 'middle' }, digits(v)));
    }
    for (const v of ticks(rangeY, 5)) {
      lines[v === 0 ? 'zero' : 'grid'] += `M${left} ${placeY(v).toFixed(1)}H${width - right}`;
      nodes.push(make('text', { x: left - 5, y: placeY(v) + 4, 'text-anchor': 'end' }, digits(v)));
    }
    nodes.push(make('text', { x: (left + width - right) / 2, y: height - 8, 'text-anchor': 'middle' }, `${x.name} [${unitX}]`));
    nodes.push(make('text', { transform: `translate(13 ${(top + height - bottom) / 2}) rotate(-90)`, 'text-anchor': 'middle' }, `${y.name} [${unitY}]`));
    const paths = curves.map((curve, k) => {
      let text = '', pen = 'M';
      for (let i = 0; i < curve.x.length; i += 1) {
        const a = curve.x[i] / sizeX, b = curve.y[i] / sizeY;
        if (!Number.isFinite(a + b)) { pen = 'M'; continue; }
        text += `${pen}${placeX(a).toFixed(1)} ${placeY(b).toFixed(1)}`;
        pen = 'L';
      }
      return make('path', { class: k < curves.length - 1 ? 'curve before' : 'curve', d: text });
    });
    const [least, most] = extent(curves.map(c => c.y)).map(v => digits(v / sizeY));
    figure.svg.replaceChildren(...Object.entries(lines).map(([kind, d]) => make('path', { class: kind, d })), ...paths, ...nodes);
    figure.svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    figure.svg.setAttribute('aria-label', `${figure.title}: ${y.name} from ${least} to ${most} ${unitY}`);
  };

  // ---- what the functions return ----

  const steadyCurve = () => {
    const [N] = of('contact'), x = [], y = [];
    for (let k = -400; k <= 400; k += 1) {
      const v = about.window * Math.sinh(k / 400 * 9) / Math.sinh(9);
      x.push(v);
      y.push(steady([v, N, ...of('inputs')], of('law'))[0]);
    }
    return { x, y };
  };

  /** Repeat a step; return every `each`-th row of states and outputs. */
  const repeated = (step, start, parameters, count, each) => {
    const rows = [];
    let row = start;
    for (let k = 1; k <= count; k += 1) {
      row = step(row, parameters, []);
      if (k % each === 0) rows.push(row);
    }
    return rows;
  };

  const loopRows = parts => {
    const [N, A, f] = of('contact'), { start, h } = about.runs.loop;
    const p = [A, 2 * Math.PI * f, N, ...of('inputs'), ...of('law'), h / f / parts];
    const per = Math.round(1 / h);  // steps of a period, which takes 1 s by default
    return repeated(loop, start, p, about.periods * per * parts, per * parts / about.points);
  };

  const beltRows = parts => {
    const { start, h } = about.runs.belt, each = Math.round(about.step / h) * parts;
    const count = Math.round(about.end / about.step) * each;
    return repeated(belt, start, [...of('belt'), ...of('law'), h / parts], count, each);
  };

  /** Largest difference of a column of two runs, relative to its peak; NaN if a number is not finite. */
  const difference = (rows, finer, column) => {
    let most = 0, peak = 0;
    for (let k = 0; k < rows.length; k += 1) {
      most = Math.max(most, Math.abs(rows[k][column] - finer[k][column]));
      peak = Math.max(peak, Math.abs(finer[k][column]));
    }
    return peak ? most / peak : most;
  };

  // ---- figures ----

  const figures = {
    steady: { title: 'Force in steady sliding' },
    loop: { title: 'Force in a sinusoidal motion' },
    belt: { title: 'Block on the belt', wide: true, tight: true },
  };
  const over = make('select', { 'aria-label': 'abscissa of the second figure' },
    make('option', { value: 'x' }, 'force over displacement'), make('option', { value: 'v' }, 'force over velocity'));
  const holders = Object.entries(figures).map(([name, figure]) => {
    figure.svg = make('svg', { role: 'img' });
    figure.note = make('span');
    const reason = about.missing[name];
    const inside = reason ? [make('figcaption', {}, `${figure.title}: none. ${reason}`)]
      : [figure.svg, make('figcaption', {}, make('strong', {}, `${figure.title}. `), figure.note)];
    return make('figure', { class: figure.wide ? 'wide' : '', 'data-figure': name }, ...inside);
  });
  const step = name => `Fixed steps of ${digits(about.runs[name].h)} ${name === 'loop' ? 'of a period' : 's'} by ${about.runs[name].method}; `
    + `at the default values they differ from the adaptive run by at most ${digits(about.runs[name].error, 2)} of the peak.`;
  const texts = {
    steady: () => `N = ${digits(of('contact')[0])} N.`,
    loop: () => `The first half period is dashed. ${step('loop')}`,
    belt: () => step('belt'),
  };

  const last = {};
  const redraw = () => {
    const speed = `${length}/s`;
    draw(figures.steady, { name: 'velocity v', unit: speed }, { name: 'force F', unit: force }, [steadyCurve()]);
    figures.steady.note.textContent = texts.steady();
    if (about.runs.loop) {
      const rows = last.loop = loopRows(1), v = rows[0].length - 2, abscissa = over.value === 'x' ? 0 : v;
      const part = some => ({ x: some.map(r => r[abscissa]), y: some.map(r => r[v + 1]) });
      const x = over.value === 'x' ? { name: 'displacement x', unit: length } : { name: 'velocity v', unit: speed };
      draw(figures.loop, x, { name: 'force F', unit: force }, [part(rows.slice(0, about.points / 2)), part(rows.slice(about.points / 2))]);
      figures.loop.note.textContent = texts.loop();
    }
    if (about.runs.belt) {
      const rows = last.belt = beltRows(1), thin = rows.filter((_, k) => k % 5 === 4);
      const curve = { x: [0, ...thin.map((_, k) => 5 * (k + 1) * about.step)], y: [about.runs.belt.start[0], ...thin.map(r => r[0])] };
      draw(figures.belt, { name: 'time t', unit: 's' }, { name: 'spring elongation x', unit: 'm' }, [curve]);
      figures.belt.note.textContent = texts.belt();
    }
    clearTimeout(last.timer);
    last.timer = setTimeout(compare, 400);
  };

  /** Say how much halved steps change the curves at the present values. */
  const compare = () => {
    for (const [name, rowsOf] of [['loop', loopRows], ['belt', beltRows]]) {
      if (!about.runs[name]) continue;
      const rows = last[name], column = name === 'belt' ? 0 : rows[0].length - 1;
      const share = difference(rows, rowsOf(2), column);
      const said = Number.isNaN(share) ? 'the steps do not stay finite: use symfric.'
        : share <= 0.01 ? `halving the step changes the curve by ${digits(share, 2)} of the peak.`
        : 'halving the step changes the curve visibly: do not rely on it, use symfric.';
      figures[name].note.textContent = `${texts[name]()} Here, ${said}`;
    }
    root.dataset.compared = 'true';
  };

  // ---- sliders ----

  const warning = make('p', { class: 'warning', role: 'status' });
  const check = () => {
    const value = name => values.get('law' + name);
    warning.textContent = about.ordered
      .filter(([a, b, strict]) => value(a) > value(b) || (strict && value(a) === value(b)))
      .map(([a, b, strict]) => `The law is made for ${a} ${strict ? '<' : '≤'} ${b}. `).join('');
  };
  let waiting = false;
  const later = () => {
    root.dataset.compared = 'false';
    check();
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; redraw(); });
  };

  const resets = [];
  const row = item => {
    const key = item.group + item.name, span = item.log ? Math.log(item.high / item.low) : item.high - item.low;
    const unit = unitOf(item);
    const range = make('input', { type: 'range', min: 0, max: 1000, step: 1, 'data-name': key });
    const shown = make('span', { class: 'value' });
    const show = () => {
      shown.textContent = `${digits(values.get(key))} ${unit}`.trim();
      range.setAttribute('aria-valuetext', shown.textContent);
    };
    const reset = () => {
      values.set(key, item.value);
      range.value = 1000 * (item.log ? Math.log(item.value / item.low) : item.value - item.low) / span;
      show();
    };
    range.addEventListener('input', () => {
      const share = range.value / 1000;
      values.set(key, item.log ? item.low * Math.exp(share * span) : item.low + share * span);
      show();
      later();
    });
    reset();
    resets.push(reset);
    return make('label', {}, make('code', {}, item.name), ' ', shown, range, make('small', {}, item.doc));
  };
  const sets = Object.entries(groups)
    .map(([group, title]) => [title, all.filter(item => item.group === group && moves(item))])
    .filter(([, items]) => items.length)
    .map(([title, items]) => make('fieldset', {}, make('legend', {}, title), ...items.map(row)));

  const button = make('button', { type: 'button' }, 'Reset all values');
  button.addEventListener('click', () => { for (const reset of resets) reset(); later(); });
  over.addEventListener('change', later);
  root.replaceChildren(make('div', { class: 'curves' }, ...holders), button, ...(about.runs.loop ? [over] : []), warning, ...sets);
  let width = root.clientWidth;
  redraw();
  new ResizeObserver(() => {
    if (root.clientWidth !== width) later();
    width = root.clientWidth;
  }).observe(root);
})();
