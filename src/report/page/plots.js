// What every plot of a report shares: its data, legend, gestures' hint and the axes that are linked.
// Labels come from logs: they are set as text, never as markup.
'use strict';
const flyball = (() => {
  const all = [];  // The plots that were made, in the page's order of appearance.
  const animations = [];

  /** A colour of the page's style sheet, as it is now in this scheme. */
  const color = name => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
  const lineColor = line =>
      color(line.style === 'guide' ? 'guide' : 'c' + line.color);

  const dashes = {dashed: [9, 4], dash_dot: [10, 3, 2, 3], dotted: [2, 3]};
  const scattered = style => ['points', 'crosses', 'circles', 'squares', 'frames', 'diamonds'].includes(style);

  function make(name, properties = {}, ...children) {
    const element = Object.assign(document.createElement(name), properties);
    element.append(...children);
    return element;
  }

  /** Four significant digits, as people write them. */
  function number(value) {
    if (!Number.isFinite(value)) return '';
    const size = Math.abs(value);
    return value === 0                   ? '0'
        : size >= 1e6 || size < 1e-4 ? value.toExponential(3).replace('-', '\u2212').replace('e-', 'e\u2212')
                                     : String(Number(value.toPrecision(4))).replace('-', '\u2212');
  }

  /** Ticks at 1, 2 or 5 times a power of ten; of a logarithmic axis, which holds log10, at decades. */
  function ticks(low, high, most, logarithmic) {
    const list = [];
    if (logarithmic && high - low > 0.8) {
      for (let decade = Math.floor(low); decade <= high + 1e-6; ++decade) {
        for (let digit = 1; digit < 10; ++digit) {
          const v = decade + Math.log10(digit);
          if (v < low - 1e-6 || v > high + 1e-6) continue;
          const shown = digit === 1 || (high - low < 2.2 && (digit === 2 || digit === 5));
          list.push({v, label: shown ? number(digit * 10 ** decade) : ''});
        }
      }
      return list;
    }
    const least = (high - low) / Math.max(1, most);
    const power = 10 ** Math.floor(Math.log10(least));
    const step = [1, 2, 5, 10].find(factor => factor * power >= least * (1 - 1e-9)) * power;
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) {
      const v = k * step;
      list.push({v, label: number(logarithmic ? 10 ** v : Number(v.toPrecision(12)))});
    }
    return list;
  }

  /** The columns of a figure: 32-bit differences from a base, little-endian, in base64. */
  function columns(figure) {
    const text = atob(figure.data);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    const values = new Float32Array(bytes.buffer);
    let at = 0;
    return figure.columns.map(([count, base]) => {
      const column = new Float64Array(count);
      for (let i = 0; i < count; ++i) column[i] = base + values[at + i];
      at += count;
      return column;
    });
  }

  /** Puts the columns where lines and bands name them; axes that are logarithmic become log10. */
  function unpack(figure) {
    const raw = columns(figure);
    const logs = new Map();
    const column = (index, logarithmic) => {
      if (!logarithmic) return raw[index];
      if (!logs.has(index)) logs.set(index, raw[index].map(Math.log10));
      return logs.get(index);
    };
    for (const panel of figure.panels) {
      for (const line of panel.lines) {
        line.x = column(line.x, figure.logX);
        line.y = column(line.y, panel.logY);
      }
      for (const band of panel.bands) {
        band.x = column(band.x, figure.logX);
        band.low = column(band.low, panel.logY);
        band.high = column(band.high, panel.logY);
      }
      for (const mark of panel.marks) {
        if (mark.vertical ? figure.logX : panel.logY) mark.at = Math.log10(mark.at);
      }
    }
    return figure;
  }

  /** The columns of an animation, put where its parts and values name them. */
  function drawing(data) {
    const raw = columns(data);
    const column = index => index === undefined ? null : raw[index];
    data.time = column(data.time);
    for (const part of data.parts)
      for (const name of ['x', 'y', 'toX', 'toY', 'angle']) part[name] = column(part[name]);
    for (const value of data.values) value.values = column(value.values);
    return data;
  }

  /** The first index whose value is not below. */
  function lower(x, value) {
    let low = 0;
    let high = x.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (x[middle] < value) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  function sample(line, kind) {
    const paths = {points: 'M13 5m-3 0a3 3 0 1 0 6 0a3 3 0 1 0 -6 0', crosses: 'M9 1l8 8M17 1l-8 8',
                   circles: 'M13 5m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0', squares: 'M9 1h8v8h-8z', frames: 'M8.5 .5h9v9h-9z', diamonds: 'M13 0l5 5l-5 5l-5 -5z'};
    const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
    for (const [name, value] of Object.entries({width: 26, height: 10, 'aria-hidden': true}))
      svg.setAttribute(name, value);
    const filled = kind === 'band' || line.style === 'points';
    path.setAttribute('d', kind === 'band' ? 'M0 0h26v10h-26z' : paths[line.style] || 'M0 5h26');
    path.setAttribute('fill', filled ? 'currentColor' : 'none');
    path.setAttribute('stroke', filled ? 'none' : 'currentColor');
    path.setAttribute('stroke-width', 2);
    if (kind === 'band') path.setAttribute('opacity', 0.3);
    if (dashes[line.style]) path.setAttribute('stroke-dasharray', dashes[line.style].join(' '));
    svg.append(path);
    svg.style.color = `var(--${line.span ? 'span-key' : 'c' + line.color})`;
    return svg;
  }

  /**
   * The row over a panel: the axis' name and unit, and each curve's sample, name and value under the
   * cursor. A click on a name hides its curve.
   */
  function legend(panel, toggled) {
    const row = make('div', {className: 'legend'}, make('span', {className: 'axis', textContent: panel.y}));
    const add = (shown, kind) => {
      shown.visible = true;
      const value = make('output');
      const name = make('button', {type: 'button', title: 'Show or hide'}, sample(shown, kind),
                        make('span', {textContent: shown.label}));
      name.setAttribute('aria-pressed', 'true');
      name.addEventListener('click', () => {
        shown.visible = !shown.visible;
        name.setAttribute('aria-pressed', String(shown.visible));
        toggled();
      });
      shown.show = text => { value.textContent = text; };
      row.append(shown.label ? make('span', {className: 'entry'}, name, value) : value);
    };
    for (const band of panel.bands) add(band, 'band');
    for (const line of panel.lines) line.style === 'guide' ? line.visible = true : add(line, 'line');
    for (const label of new Set(panel.spans.map(span => span.label).filter(Boolean)))
      row.append(make('span', {className: 'entry'}, sample({span: true}, 'band'), label));
    return row;
  }

  /** The title, where the cursor is, and the way back from a zoom. */
  function bar(figure, reset) {
    const at = make('output');
    const back = make('button', {type: 'button', textContent: 'Show all', hidden: true});
    back.addEventListener('click', reset);
    const element = make('div', {className: 'bar'}, make('strong', {textContent: figure.title}), at, back);
    return {element, at: text => { at.textContent = text; }, zoomed: yes => { back.hidden = !yes; }};
  }

  function diamond(c, x, y, r) {
    c.moveTo(x + r, y);
    c.lineTo(x, y + r);
    c.lineTo(x - r, y);
    c.lineTo(x, y - r);
    c.closePath();
  }

  /**
   * A label beside an upright line, where it hides the fewest curves and other lines: to the right
   * and at the top if that is nowhere. `heights(x)` are those of the curves at a pixel, `lines` the
   * pixels of all upright lines, `taken` the places of the labels so far.
   */
  function beside(context, label, x, area, heights, lines, taken) {
    if (!label) return;
    const wide = context.measureText(label).width + 4;
    const after = x + 4 + wide < area.x + area.w;
    let best = null;
    for (const left of [...(after ? [x + 4] : []), ...(x - wide > area.x || !after ? [x - wide] : [])]) {
      const there = [];
      for (let k = 0; k <= 12; ++k) there.push(...heights(left + k / 12 * wide));
      const crossed = lines.filter(line => line > left && line < left + wide).length;
      for (const share of [0, 1, 0.13, 0.87, 0.28, 0.72, 0.5]) {
        const middle = area.y + 8 + share * (area.h - 16);
        const hidden = crossed + there.filter(y => Math.abs(y - middle) < 10).length +
            1000 * taken.filter(other => other.left < left + wide && left < other.right &&
                                         Math.abs(other.middle - middle) < 14).length;
        if (!best || hidden < best.hidden) best = {hidden, left, middle};
      }
    }
    taken.push({left: best.left, right: best.left + wide, middle: best.middle});
    context.fillText(label, best.left, best.middle + 4);
  }

  /** Once a frame, however often it is asked for. */
  function each_frame(work) {
    let waiting = false;
    return () => {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        work();
      });
    };
  }

  /** Fingers: one moves along x, two zoom, two taps show all. `view` has range, show(range), reset. */
  function touches(view, x_of) {
    let start = null;
    let tapped = 0;
    const begin = event => {
      const list = [...event.touches].map(x_of);
      start = {x: list[0], gap: list.length > 1 ? Math.abs(list[1] - list[0]) : 0,
               middle: list.length > 1 ? (list[0] + list[1]) / 2 : list[0], range: view.range(), moved: false};
    };
    return {
      touchstart: begin,
      touchmove(event) {
        if (!start) return;
        start.moved = true;
        const list = [...event.touches].map(x_of);
        const [from, to] = start.range;
        const width = view.width();
        const middle = list.length > 1 ? (list[0] + list[1]) / 2 : list[0];
        const factor = list.length > 1 && start.gap > 0 ? start.gap / Math.max(8, Math.abs(list[1] - list[0])) : 1;
        const anchor = from + (to - from) * (start.middle - view.left()) / width;
        const span = (to - from) * factor;
        const low = anchor - span * (middle - view.left()) / width;
        view.show([low, low + span]);
      },
      touchend(event) {
        if (event.touches.length) return begin(event);
        if (start && !start.moved) {
          const now = Date.now();
          if (now - tapped < 400) view.reset();
          tapped = now;
        }
        start = null;
      },
      touchcancel() { start = null; },
    };
  }

  return {all, animations, color, lineColor, dashes, scattered, make, number, ticks, unpack, legend, bar, beside, each_frame, touches, diamond, lower, drawing};
})();
