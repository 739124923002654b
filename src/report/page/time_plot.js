// Plots over time or frequency, by dygraphs. Of long series it is given what the pixels can show.
flyball.TimePlot = (() => {
  const {make, number, lower} = flyball;

  /** The plots that share an x axis: what one shows and where its cursor is, all show. */
  class Clock {
    constructor() {
      this.plots = [];
      this.range = null;  // null: all of each.
      this.redraw = flyball.each_frame(() => this.plots.forEach(plot => plot.refresh()));
      this.point = flyball.each_frame(() => this.plots.forEach(plot => plot.point(this.cursor)));
    }
    /** While it moves, frames matter more than pixels; it is drawn in full when it rests. */
    show(range) {
      this.range = range;
      this.coarse = true;
      this.redraw();
      clearTimeout(this.rest);
      this.rest = setTimeout(() => {
        this.coarse = false;
        this.redraw();
      }, 150);
    }
    /** While something plays, the cursor is its. */
    at(x, by) {
      if (this.player && this.player !== by) return;
      this.cursor = x;
      this.point();
    }
  }
  const clocks = new Map();
  function clock_of(name) {
    if (!name) return new Clock();
    if (!clocks.has(name)) clocks.set(name, new Clock());
    return clocks.get(name);
  }
  flyball.clock_of = clock_of;

  /**
   * The rows that look as all of them do: of each of `count` columns of pixels the first, the last,
   * each curve's least and greatest, and a gap. Outside the window a few, so that moving shows them.
   */
  function chosen(x, ys, from, to, count) {
    const rows = [];
    const take = (begin, end, columns) => {
      if (end - begin <= 4 * columns) {
        for (let i = begin; i < end; ++i) rows.push(i);
        return;
      }
      const scale = columns / (x[end - 1] - x[begin] || 1);
      for (let i = begin; i < end;) {
        const edge = x[begin] + (Math.floor((x[i] - x[begin]) * scale) + 1) / scale;
        let stop = i + 1;
        while (stop < end && x[stop] < edge) ++stop;
        const kept = [i, stop - 1];
        for (const y of ys) {
          let least = i;
          let greatest = i;
          for (let k = i; k < stop; ++k) {
            const value = y[k];
            if (value < y[least]) least = k;
            else if (value > y[greatest]) greatest = k;
            else if (value !== value) {
              kept.push(k);
              if (least === k || y[least] !== y[least]) least = greatest = Math.min(k + 1, stop - 1);
            }
          }
          kept.push(least, greatest);
        }
        kept.sort((a, b) => a - b);
        for (let k = 0; k < kept.length; ++k) if (k === 0 || kept[k] !== kept[k - 1]) rows.push(kept[k]);
        i = stop;
      }
    };
    const first = Math.max(0, lower(x, from) - 1);
    const last = Math.min(x.length, lower(x, to) + 1);
    take(0, first, 100);
    take(first, last, count);
    take(last, x.length, 100);
    return rows;
  }

  const shapes = {
    crosses(c, x, y, r) { c.moveTo(x - r, y - r); c.lineTo(x + r, y + r); c.moveTo(x + r, y - r); c.lineTo(x - r, y + r); },
    circles(c, x, y, r) { c.arc(x, y, r, 0, 2 * Math.PI); },
    squares(c, x, y, r) { c.rect(x - r, y - r, 2 * r, 2 * r); },
    frames(c, x, y, r) { c.rect(x - 1.7 * r, y - 1.7 * r, 3.4 * r, 3.4 * r); },
    diamonds(c, x, y, r) { flyball.diamond(c, x, y, 2.7 * r); },
  };
  function shape(style) {
    return (g, name, context, x, y, color, size) => {
      context.beginPath();
      context.strokeStyle = color;
      context.lineWidth = 1.5;
      shapes[style](context, x, y, size);
      context.stroke();
    };
  }

  class Panel {
    constructor(plot, panel, last) {
      this.plot = plot;
      this.panel = panel;
      this.levels = panel.marks.filter(mark => !mark.vertical && Number.isFinite(mark.at));
      // The series that dygraphs sees: curves, the edges of bands, and levels, which stretch the axis.
      this.series = [
        ...panel.lines.map(line => ({x: line.x, y: line.y, of: line})),
        ...panel.bands.flatMap(band => [{x: band.x, y: band.low, of: band, edge: true},
                                        {x: band.x, y: band.high, of: band, edge: true}]),
      ];
      this.axes = [...new Set(this.series.map(series => series.x))];
      this.hair = make('div', {className: 'hair', hidden: true});
      this.box = make('div', {className: 'panel'});
      this.box.style.height = `${([0, 320, 220][plot.figure.panels.length] || 170) + (last ? 0 : -14)}px`;
      this.frame = make('div', {className: 'frame'}, this.box, this.hair);
      plot.live.append(flyball.legend(panel, () => this.toggle()), this.frame);
      this.draw(last);
    }

    rows(range) {
      const width = Math.max(200, this.box.clientWidth) / (this.plot.clock.coarse ? 4 : 1.5);
      const [from, to] = range;
      const parts = this.axes.map(x => {
        const own = this.series.filter(series => series.x === x);
        return {x, own, rows: chosen(x, own.map(series => series.y), from, to, width)};
      });
      const levels = this.levels.map(mark => mark.at);
      if (parts.length === 1) {
        const [{x, own, rows}] = parts;
        return rows.map(i => [x[i], ...own.map(series => series.y[i]), ...levels]);
      }
      // Several clocks in one panel: a row for each x of any; a curve without that x has no value.
      const merged = new Map();
      for (const {x, own, rows} of parts) {
        const places = own.map(series => this.series.indexOf(series) + 1);
        for (const i of rows) {
          let row = merged.get(x[i]);
          if (!row) {
            row = [x[i], ...this.series.map(() => null), ...levels];
            merged.set(x[i], row);
          }
          own.forEach((series, k) => { row[places[k]] = series.y[i]; });
        }
      }
      return [...merged.values()].sort((a, b) => a[0] - b[0]);
    }

    /** Of long series that move the lines are thin and whole: others take many times as long to fill. */
    styles() {
      const series = {};
      const quick = this.plot.clock.coarse && this.axes.some(x => x.length > 2000);
      const thin = 1 / (window.devicePixelRatio || 1);
      this.series.forEach(({of: line, edge}, i) => {
        const points = flyball.scattered(line.style);
        series['s' + i] = {
          color: edge ? 'rgba(0,0,0,0)' : flyball.lineColor(line),
          strokeWidth: edge || points ? 0 : quick ? thin : line.style === 'samples' || line.style === 'guide' ? 1 : 1.8,
          strokePattern: quick ? null : flyball.dashes[line.style] || null,
          stepPlot: line.style === 'steps',
          drawPoints: !edge && (points || line.style === 'samples'),
          pointSize: line.style === 'points' || line.style === 'samples' ? (line.x.length > 300 ? 1.2 : 2.2) : 4,
          drawPointCallback: shapes[line.style] ? shape(line.style) : undefined,
        };
      });
      this.levels.forEach((mark, i) => {
        series['m' + i] = {color: flyball.color('mark'), strokeWidth: 1, strokePattern: [6, 4]};
      });
      return {series, gridLineColor: flyball.color('grid'), axisLineColor: flyball.color('mark')};
    }

    visibility() {
      return [...this.series.map(series => series.of.visible), ...this.levels.map(() => true)];
    }

    toggle() {
      this.graph.updateOptions({visibility: this.visibility()});
    }

    draw(last) {
      const {plot, panel} = this;
      const {figure, clock} = plot;
      const view = {
        range: () => this.graph.xAxisRange(),
        left: () => this.graph.getArea().x,
        width: () => this.graph.getArea().w,
        show: range => plot.show(range),
        reset: () => plot.reset(),
      };
      const labels = ['x', ...this.series.map((_, i) => 's' + i), ...this.levels.map((_, i) => 'm' + i)];
      this.graph = new Dygraph(this.box, this.rows(plot.shown()), {
        labels, ...this.styles(), visibility: this.visibility(), dateWindow: plot.shown(),
        ...(panel.limits ? {valueRange: panel.limits} : {}), connectSeparatedPoints: true, legend: 'never',
        highlightCircleSize: 0, gridLineWidth: 1, axisLabelFontSize: 12, yRangePad: 8, xRangePad: 0,
        xAxisHeight: last ? 22 : 8,
        axes: {
          x: {ticker: (low, high, pixels) => flyball.ticks(low, high, pixels / 80, figure.logX)
                  .map(tick => ({v: tick.v, label: last ? tick.label : ''}))},
          y: {axisLabelWidth: 54, ticker: (low, high, pixels) => panel.ticks.length
                  ? [] : flyball.ticks(low, high, pixels / 34, panel.logY)},
        },
        underlayCallback: (context, area, graph) => this.underlay(context, area, graph),
        drawCallback: (graph, initial) => {
          if (!initial && !this.busy) plot.moved(graph.xAxisRange());
        },
        interactionModel: {
          ...Dygraph.defaultInteractionModel,
          ...flyball.touches(view, touch => touch.clientX - this.box.getBoundingClientRect().left),
          dblclick: () => plot.reset(),
          wheel: (event, graph) => {
            if (!event.ctrlKey && !event.metaKey) return;
            event.preventDefault();
            const x = graph.toDataXCoord(graph.eventToDomCoords(event)[0]);
            plot.zoom(Math.exp(0.002 * event.deltaY), x);
          },
        },
      });
      this.box.addEventListener('mousemove', event => {
        clock.at(this.graph.toDataXCoord(this.graph.eventToDomCoords(event)[0]));
      });
      this.box.addEventListener('mouseleave', () => clock.at(undefined));
    }

    refresh(range) {
      this.busy = true;
      this.graph.updateOptions({...this.styles(), file: this.rows(range), dateWindow: range});
      this.busy = false;
    }

    show_all() {
      this.busy = true;
      this.graph.resetZoom();
      this.busy = false;
    }

    underlay(context, area, graph) {
      const {panel, plot} = this;
      const x_of = x => graph.toDomXCoord(plot.figure.logX ? Math.log10(x) : x);
      context.save();
      context.beginPath();
      context.rect(area.x, area.y, area.w, area.h);
      context.clip();
      context.fillStyle = flyball.color('span');
      for (const span of panel.spans)
        context.fillRect(x_of(span.from), area.y, x_of(span.to) - x_of(span.from), area.h);
      panel.bands.forEach(band => this.shade(context, graph, band));
      context.font = '12px system-ui, sans-serif';
      context.strokeStyle = flyball.color('mark');
      context.fillStyle = flyball.color('quiet');
      context.setLineDash([6, 4]);
      const taken = [];
      const curves = panel.lines.filter(line => line.visible && line.style !== 'guide' && line.x.length);
      const heights = x => {
        const at = graph.toDataXCoord(x);
        return curves.filter(line => at >= line.x[0] && at <= line.x[line.x.length - 1])
            .map(line => graph.toDomYCoord(line.y[Math.min(lower(line.x, at), line.x.length - 1)]));
      };
      const lines = panel.marks.filter(mark => mark.vertical).map(mark => graph.toDomXCoord(mark.at));
      for (const mark of panel.marks.filter(mark => Number.isFinite(mark.at))) {
        if (mark.vertical) {
          const x = graph.toDomXCoord(mark.at);
          context.beginPath();
          context.moveTo(x, area.y);
          context.lineTo(x, area.y + area.h);
          context.stroke();
          flyball.beside(context, mark.label, x, area, heights, lines, taken);
        } else {
          context.textAlign = 'right';
          const y = graph.toDomYCoord(mark.at);
          context.fillText(mark.label, area.x + area.w - 4, y < area.y + 16 ? y + 14 : y - 4);
          context.textAlign = 'left';
        }
      }
      for (const note of panel.notes) context.fillText(note.text, x_of(note.x) + 6, graph.toDomYCoord(note.y) - 6);
      context.restore();
    }

    shade(context, graph, band) {
      if (!band.visible) return;
      const [from, to] = graph.xAxisRange();
      const rows = chosen(band.x, [band.low, band.high], from, to, this.box.clientWidth)
                       .filter(i => Number.isFinite(band.low[i]) && Number.isFinite(band.high[i]));
      context.beginPath();
      for (const i of rows) context.lineTo(graph.toDomXCoord(band.x[i]), graph.toDomYCoord(band.low[i]));
      for (const i of rows.reverse()) context.lineTo(graph.toDomXCoord(band.x[i]), graph.toDomYCoord(band.high[i]));
      context.globalAlpha = 0.22;
      context.fillStyle = flyball.lineColor(band);
      context.fill();
      context.globalAlpha = 1;
      context.fillStyle = flyball.color('span');
    }

    /** Values at the cursor: each curve's nearest one. */
    point(x) {
      const [from, to] = this.graph.xAxisRange();
      this.hair.hidden = !(x >= from && x <= to);
      if (!this.hair.hidden) this.hair.style.left = `${this.graph.toDomXCoord(x)}px`;
      const nearest = column => {
        const at = lower(column, x);
        return at > 0 && (at === column.length || x - column[at - 1] < column[at] - x) ? at - 1 : at;
      };
      const value = y => number(this.panel.logY ? 10 ** y : y);
      for (const line of this.panel.lines) {
        const inside = x >= line.x[0] && x <= line.x[line.x.length - 1];
        line.show?.(inside ? value(line.y[nearest(line.x)]) : '');
      }
      for (const band of this.panel.bands) {
        const at = nearest(band.x);
        const inside = x >= band.x[0] && x <= band.x[band.x.length - 1];
        band.show(inside ? `${value(band.low[at])} … ${value(band.high[at])}` : '');
      }
    }
  }

  return class TimePlot {
    constructor(figure, live) {
      this.figure = figure;
      this.live = live;
      this.clock = clock_of(figure.clock);
      this.extent = [Infinity, -Infinity];
      for (const panel of figure.panels) {
        const stretch = figure.logX ? [] : panel.spans.map(({from, to}) => [from, to]);
        for (const x of [...stretch, ...panel.lines.map(line => line.x), ...panel.bands.map(band => band.x)]) {
          if (!x.length) continue;
          this.extent = [Math.min(this.extent[0], x[0]), Math.max(this.extent[1], x[x.length - 1])];
        }
      }
      this.bar = flyball.bar(figure, () => this.reset());
      live.append(this.bar.element);
      this.panels = figure.panels.map((panel, i) => new Panel(this, panel, i + 1 === figure.panels.length));
      live.append(make('div', {className: 'x-axis', textContent: figure.x}));
      this.bar.zoomed(this.clock.range !== null);
      this.clock.plots.push(this);
    }

    /** What all of its panels show of x, also those whose curves are shorter. */
    shown() { return this.clock.range || this.extent; }
    range() { return this.panels[0].graph.xAxisRange(); }

    show([from, to]) {
      const [first, last] = this.extent;
      const span = Math.min(last - first, Math.max(to - from, 1e-6 * (last - first)));
      const low = Math.min(Math.max(from, first), last - span);
      this.clock.show(span < last - first ? [low, low + span] : null);
    }
    moved(range) {
      const now = this.shown();
      if (range[0] !== now[0] || range[1] !== now[1]) this.clock.show(range);
    }
    zoom(factor, about) {
      const [from, to] = this.range();
      const at = about === undefined ? 0.5 * (from + to) : about;
      this.show([at - factor * (at - from), at + factor * (to - at)]);
    }
    pan(share) {
      const [from, to] = this.range();
      this.show([from + share * (to - from), to + share * (to - from)]);
    }
    reset() {
      for (const plot of this.clock.plots) plot.panels.forEach(panel => panel.show_all());
      this.clock.show(null);
    }
    refresh() {
      this.panels.forEach(panel => panel.refresh(this.shown()));
      this.bar.zoomed(this.clock.range !== null);
    }
    point(x) {
      this.panels.forEach(panel => panel.point(x));
      const axis = this.figure.x;
      const value = number(this.figure.logX ? 10 ** x : x);
      this.bar.at(value && `${axis.replace(/ \(.*\)$/, '')} ${value} ${(/\(([^()]*)\)$/.exec(axis) || ['', ''])[1]}`);
    }
    restyle() {
      this.panels.forEach(panel => panel.graph.updateOptions(panel.styles()));
    }
  };
})();
