// x–y plots: pole maps, Nyquist curves, phase planes, paths. dygraphs sorts by x, these keep their order.
flyball.XyPlot = (() => {
  const {make, number} = flyball;
  const margin = {left: 58, right: 12, top: 8, bottom: 26};
  const font = '12px system-ui, sans-serif';

  class Panel {
    constructor(plot, panel, height) {
      this.plot = plot;
      this.panel = panel;
      this.canvas = make('canvas', {className: 'xy'});
      this.height = height;
      plot.live.append(flyball.legend(panel, () => this.draw()), make('div', {className: 'frame'}, this.canvas));
      this.listen();
      new ResizeObserver(() => this.resize()).observe(this.canvas.parentNode);
      this.resize();
    }

    resize() {
      const width = this.canvas.parentNode.clientWidth;
      if (!width || width === this.width) return;
      this.width = width;
      const scale = window.devicePixelRatio || 1;
      const height = this.plot.figure.equal ? Math.min(this.height, Math.max(260, width)) : this.height;
      Object.assign(this.canvas, {width: width * scale, height: height * scale});
      Object.assign(this.canvas.style, {width: `${width}px`, height: `${height}px`});
      const c = this.canvas.getContext('2d');
      c.font = font;
      const left = Math.max(margin.left, ...this.panel.ticks.map(tick => 10 + c.measureText(tick.label).width));
      this.area = {x: left, y: margin.top, w: width - left - margin.right,
                   h: height - margin.top - margin.bottom};
      this.view = this.fitted(this.view || this.all());
      this.draw();
    }

    /** The extent of everything but guides, with some room. */
    all() {
      const {panel, plot} = this;
      const view = {x: [Infinity, -Infinity], y: [Infinity, -Infinity]};
      const see = (axis, value) => {
        if (!Number.isFinite(value)) return;
        axis[0] = Math.min(axis[0], value);
        axis[1] = Math.max(axis[1], value);
      };
      for (const line of panel.lines) {
        if (line.style === 'guide') continue;
        line.x.forEach(value => see(view.x, value));
        line.y.forEach(value => see(view.y, value));
      }
      for (const band of panel.bands) {
        band.x.forEach(value => see(view.x, value));
        band.low.forEach(value => see(view.y, value));
        band.high.forEach(value => see(view.y, value));
      }
      for (const mark of panel.marks) see(mark.vertical ? view.x : view.y, mark.at);
      if (plot.figure.circle) [-1, 1].forEach(value => { see(view.x, value); see(view.y, value); });
      if (panel.limits) view.y = [...panel.limits];
      for (const axis of [view.x, view.y]) {
        if (axis[0] > axis[1]) axis.splice(0, 2, -1, 1);
        const room = axis === view.y && panel.limits ? 0 : 0.06 * (axis[1] - axis[0]) || 0.1 * Math.abs(axis[0]) || 1;
        axis[0] -= room;
        axis[1] += room;
      }
      return view;
    }

    /** With equal axes one unit is as long on x as on y: the shorter axis shows more. */
    fitted(view) {
      if (!this.plot.figure.equal) return view;
      const unit = Math.max((view.x[1] - view.x[0]) / this.area.w, (view.y[1] - view.y[0]) / this.area.h);
      const widened = ([low, high], pixels) => {
        const middle = 0.5 * (low + high);
        return [middle - 0.5 * unit * pixels, middle + 0.5 * unit * pixels];
      };
      return {x: widened(view.x, this.area.w), y: widened(view.y, this.area.h)};
    }

    px(x) { return this.area.x + (x - this.view.x[0]) / (this.view.x[1] - this.view.x[0]) * this.area.w; }
    py(y) { return this.area.y + (this.view.y[1] - y) / (this.view.y[1] - this.view.y[0]) * this.area.h; }
    at(px, py) {
      return {x: this.view.x[0] + (px - this.area.x) / this.area.w * (this.view.x[1] - this.view.x[0]),
              y: this.view.y[1] - (py - this.area.y) / this.area.h * (this.view.y[1] - this.view.y[0])};
    }

    draw() {
      const {panel, area} = this;
      const {figure} = this.plot;
      const c = this.canvas.getContext('2d');
      const scale = window.devicePixelRatio || 1;
      c.setTransform(scale, 0, 0, scale, 0, 0);
      c.clearRect(0, 0, this.width, this.canvas.height);
      c.font = font;
      this.axes(c);
      c.save();
      c.beginPath();
      c.rect(area.x, area.y, area.w, area.h);
      c.clip();
      c.fillStyle = flyball.color('span');
      const log_x = x => figure.logX ? Math.log10(x) : x;
      for (const {from, to} of panel.spans)
        c.fillRect(this.px(log_x(from)), area.y, this.px(log_x(to)) - this.px(log_x(from)), area.h);
      panel.bands.filter(band => band.visible).forEach(band => this.band(c, band));
      if (figure.circle) {
        c.beginPath();
        for (let i = 0; i <= 180; ++i) c.lineTo(this.px(Math.cos(i * Math.PI / 90)), this.py(Math.sin(i * Math.PI / 90)));
        c.strokeStyle = flyball.color('mark');
        c.lineWidth = 1.2;
        c.stroke();
      }
      this.marks(c);
      panel.lines.filter(line => line.visible).forEach(line => this.line(c, line));
      c.fillStyle = flyball.color('quiet');
      for (const note of panel.notes) c.fillText(note.text, this.px(log_x(note.x)) + 6, this.py(note.y) - 5);
      this.overlay(c);
      c.restore();
    }

    axes(c) {
      const {area, view, panel} = this;
      const {figure} = this.plot;
      c.lineWidth = 1;
      c.fillStyle = flyball.color('fg');
      c.strokeStyle = flyball.color('grid');
      c.beginPath();
      c.textAlign = 'center';
      for (const {v, label} of flyball.ticks(...view.x, area.w / 80, figure.logX)) {
        const x = Math.round(this.px(v)) + 0.5;
        c.moveTo(x, area.y);
        c.lineTo(x, area.y + area.h);
        c.fillText(label, x, area.y + area.h + 16);
      }
      c.textAlign = 'right';
      const words = panel.ticks.map(tick => ({v: tick.at, label: tick.label}));
      for (const {v, label} of words.length ? words : flyball.ticks(...view.y, area.h / 40, panel.logY)) {
        const y = Math.round(this.py(v)) + 0.5;
        if (y < area.y || y > area.y + area.h) continue;
        c.moveTo(area.x, y);
        c.lineTo(area.x + area.w, y);
        c.fillText(label, area.x - 6, y + 4);
      }
      c.stroke();
      c.textAlign = 'left';
      c.strokeStyle = flyball.color('mark');
      c.strokeRect(area.x + 0.5, area.y + 0.5, area.w, area.h);
    }

    marks(c) {
      const {area} = this;
      c.setLineDash([6, 4]);
      c.strokeStyle = flyball.color('mark');
      c.fillStyle = flyball.color('quiet');
      const taken = [];
      const lines = this.panel.marks.filter(mark => mark.vertical).map(mark => this.px(mark.at));
      for (const mark of this.panel.marks) {
        const p = mark.vertical ? this.px(mark.at) : this.py(mark.at);
        c.beginPath();
        c.moveTo(mark.vertical ? p : area.x, mark.vertical ? area.y : p);
        c.lineTo(mark.vertical ? p : area.x + area.w, mark.vertical ? area.y + area.h : p);
        c.stroke();
        if (mark.vertical) flyball.beside(c, mark.label, p, area, () => [], lines, taken);
        else c.fillText(mark.label, area.x + 6, p - 4);
      }
      c.setLineDash([]);
    }

    band(c, band) {
      c.beginPath();
      for (let i = 0; i < band.x.length; ++i) c.lineTo(this.px(band.x[i]), this.py(band.low[i]));
      for (let i = band.x.length; i-- > 0;) c.lineTo(this.px(band.x[i]), this.py(band.high[i]));
      c.globalAlpha = 0.22;
      c.fillStyle = flyball.lineColor(band);
      c.fill();
      c.globalAlpha = 1;
    }

    line(c, line) {
      const points = flyball.scattered(line.style);
      c.strokeStyle = c.fillStyle = flyball.lineColor(line);
      c.lineWidth = line.style === 'guide' ? 1 : 1.8;
      c.setLineDash(flyball.dashes[line.style] || []);
      c.beginPath();
      let open = false;
      for (let i = 0; i < line.x.length; ++i) {
        const x = this.px(line.x[i]);
        const y = this.py(line.y[i]);
        if (!Number.isFinite(x) || !Number.isFinite(y)) {
          open = false;
        } else if (points) {
          this.shape(c, line.style, x, y);
        } else {
          open ? c.lineTo(x, y) : c.moveTo(x, y);
          open = true;
        }
      }
      line.style === 'points' ? c.fill() : c.stroke();
      c.setLineDash([]);
    }

    shape(c, style, x, y) {
      const r = style === 'points' ? 2.2 : 5;
      if (style === 'crosses') {
        c.moveTo(x - r, y - r); c.lineTo(x + r, y + r);
        c.moveTo(x + r, y - r); c.lineTo(x - r, y + r);
      } else if (style === 'squares' || style === 'frames') {
        const half = style === 'squares' ? r : 1.5 * r;
        c.rect(x - half, y - half, 2 * half, 2 * half);
      } else if (style === 'diamonds') {
        flyball.diamond(c, x, y, 2.5 * r);
      } else {
        c.moveTo(x + r, y);
        c.arc(x, y, r, 0, 2 * Math.PI);
      }
    }

    /** The nearest point's ring, and the rectangle that is being drawn. */
    overlay(c) {
      c.strokeStyle = flyball.color('fg');
      c.lineWidth = 1;
      if (this.near) {
        c.beginPath();
        c.arc(this.px(this.near.x), this.py(this.near.y), 8, 0, 2 * Math.PI);
        c.stroke();
      }
      if (this.drag?.zoom && this.drag.to) {
        const {from, to} = this.drag;
        c.fillStyle = flyball.color('span');
        c.globalAlpha = 0.6;
        c.fillRect(from.px, from.py, to.px - from.px, to.py - from.py);
        c.globalAlpha = 1;
        c.strokeRect(from.px, from.py, to.px - from.px, to.py - from.py);
      }
    }

    show(view) {
      this.view = this.fitted(view);
      this.plot.bar.zoomed(true);
      this.redraw();
    }
    zoom(factor, about) {
      const at = about || {x: 0.5 * (this.view.x[0] + this.view.x[1]), y: 0.5 * (this.view.y[0] + this.view.y[1])};
      const scaled = ([low, high], middle) => [middle - factor * (middle - low), middle + factor * (high - middle)];
      this.show({x: scaled(this.view.x, at.x), y: scaled(this.view.y, at.y)});
    }
    move(dx, dy) {
      const shifted = ([low, high], by) => [low + by, high + by];
      this.show({x: shifted(this.view.x, dx), y: shifted(this.view.y, dy)});
    }

    point(place) {
      this.near = null;
      let best = 24;
      for (const line of this.panel.lines) {
        line.show?.('');
        if (!place || !line.visible || line.style === 'guide') continue;
        for (let i = 0; i < line.x.length; ++i) {
          const distance = Math.hypot(this.px(line.x[i]) - place.px, this.py(line.y[i]) - place.py);
          if (distance < best) {
            best = distance;
            this.near = {x: line.x[i], y: line.y[i], line};
          }
        }
      }
      const {figure} = this.plot;
      const said = this.near || (place && this.at(place.px, place.py));
      const value = said && [number(figure.logX ? 10 ** said.x : said.x),
                             this.panel.ticks.length ? '' : number(this.panel.logY ? 10 ** said.y : said.y)]
                                .filter(Boolean).join(', ');
      this.near?.line.show?.(value);
      this.plot.bar.at(said ? `(${value})` : '');
      this.redraw();
    }

    listen() {
      const {canvas} = this;
      this.redraw = flyball.each_frame(() => this.draw());
      const place = event => {
        const box = canvas.getBoundingClientRect();
        return {px: event.clientX - box.left, py: event.clientY - box.top};
      };
      canvas.addEventListener('mousedown', event => {
        if (event.button) return;
        event.preventDefault();
        this.drag = {from: place(event), zoom: !event.shiftKey && !event.altKey};
        const moved = e => {
          const to = place(e);
          const last = this.drag.to || this.drag.from;
          this.drag.to = to;
          if (this.drag.zoom) return this.redraw();
          const a = this.at(last.px, last.py);
          const b = this.at(to.px, to.py);
          this.move(a.x - b.x, a.y - b.y);
        };
        const ended = () => {
          document.removeEventListener('mousemove', moved);
          document.removeEventListener('mouseup', ended);
          const {from, to, zoom} = this.drag;
          this.drag = null;
          if (zoom && to && Math.abs(to.px - from.px) > 8 && Math.abs(to.py - from.py) > 8) {
            const a = this.at(Math.min(from.px, to.px), Math.max(from.py, to.py));
            const b = this.at(Math.max(from.px, to.px), Math.min(from.py, to.py));
            this.show({x: [a.x, b.x], y: [a.y, b.y]});
          } else {
            this.redraw();
          }
        };
        document.addEventListener('mousemove', moved);
        document.addEventListener('mouseup', ended);
      });
      canvas.addEventListener('mousemove', event => { if (!this.drag) this.point(place(event)); });
      canvas.addEventListener('mouseleave', () => this.point());
      canvas.addEventListener('dblclick', () => this.plot.reset());
      canvas.addEventListener('wheel', event => {
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        const {px, py} = place(event);
        this.zoom(Math.exp(0.002 * event.deltaY), this.at(px, py));
      }, {passive: false});
      const view = {
        range: () => this.view.x, left: () => this.area.x, width: () => this.area.w, reset: () => this.plot.reset(),
        show: ([low, high]) => {
          const factor = (high - low) / (this.view.x[1] - this.view.x[0]);
          const middle = 0.5 * (this.view.y[0] + this.view.y[1]);
          this.show({x: [low, high], y: this.view.y.map(y => middle + factor * (y - middle))});
        },
      };
      const fingers = flyball.touches(view, touch => touch.clientX - canvas.getBoundingClientRect().left);
      for (const [name, handler] of Object.entries(fingers)) canvas.addEventListener(name, handler, {passive: true});
    }
  }

  return class XyPlot {
    constructor(figure, live) {
      this.figure = figure;
      this.live = live;
      this.bar = flyball.bar(figure, () => this.reset());
      live.append(this.bar.element);
      const height = figure.equal ? 560 : figure.panels[0].ticks.length ? 60 + 34 * figure.panels[0].ticks.length : 320;
      this.panels = figure.panels.map(panel => new Panel(this, panel, height));
      live.append(make('div', {className: 'x-axis', textContent: figure.x}));
    }
    range() { return this.panels[0].view.x; }
    zoom(factor) { this.panels.forEach(panel => panel.zoom(factor)); }
    pan(share) { this.panels.forEach(panel => panel.move(share * (panel.view.x[1] - panel.view.x[0]), 0)); }
    reset() {
      for (const panel of this.panels) panel.show(panel.all());
      this.bar.zoomed(false);
    }
    restyle() { this.panels.forEach(panel => panel.draw()); }
  };
})();
