// A drawing that moves. Its time is that of the plots of its clock: they show one moment.
flyball.Animation = (() => {
  const {make, number} = flyball;
  const paces = [10, 5, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005];
  const reduced = matchMedia('(prefers-reduced-motion: reduce)');
  const nominal_frame = 1 / 60;  // s
  const margin = 8;

  /** The fastest pace at which it can be followed: long motions in a third of a minute. */
  function chosen_pace(time, parts) {
    const length = time[time.length - 1] - time[0];
    let fastest = 0;  // rad/s
    for (const {angle} of parts) {
      for (let i = 1; angle && i < angle.length; ++i)
        fastest = Math.max(fastest, Math.abs(angle[i] - angle[i - 1]) / (time[i] - time[i - 1]) || 0);
    }
    return paces.find(pace => pace <= Math.max(1, length / 20) && length / pace >= 2 &&
                              pace * fastest * nominal_frame <= 0.5) || paces[paces.length - 1];
  }

  return class Animation {
    constructor(data, element) {
      this.data = data;
      this.time = data.time;
      this.clock = flyball.clock_of(data.clock);
      this.clock.plots.push(this);
      this.panels = [];  // It has none that the clock could zoom.
      this.now = this.time[0];
      this.button = make('button', {type: 'button'});
      this.slider = make('input', {type: 'range', min: 0, max: 1000, step: 1, value: 0});
      this.slider.setAttribute('aria-label', 'Time');
      this.pace = make('select', {title: 'Speed'});
      this.pace.setAttribute('aria-label', 'Speed');
      const pace = chosen_pace(this.time, data.parts);
      for (const value of paces)
        this.pace.append(new Option(value < 1 ? `1/${Math.round(1 / value)} speed` : `${value} × speed`, value, value === pace, value === pace));
      this.said = make('output');
      this.said.setAttribute('aria-live', 'off');  // The slider says it.
      this.canvas = make('canvas', {className: 'stage'});
      this.canvas.setAttribute('role', 'img');
      this.canvas.setAttribute('aria-label', data.title);
      const keys = data.parts.filter(part => part.label).map(part => {
        const key = make('span', {className: `key ${part.style}`});
        key.style.color = `var(--c${part.color})`;
        return make('span', {className: 'entry'}, key, make('span', {textContent: part.label}));
      });
      element.append(
          make('div', {className: 'bar'}, make('strong', {textContent: data.title})),
          make('div', {className: 'frame'}, this.canvas),
          make('div', {className: 'legend'}, ...keys, this.said),
          make('div', {className: 'player'}, this.button, this.slider, this.pace));
      this.extent = this.all();
      this.button.addEventListener('click', () => this.press());
      this.slider.addEventListener('input', () => {
        this.stop();
        const [first, last] = this.range();
        this.seek(first + this.slider.value / 1000 * (last - first));
      });
      reduced.addEventListener('change', () => this.stop());
      this.stop();
      new ResizeObserver(() => this.resize()).observe(this.canvas.parentNode);
      this.resize();
    }

    /** What the plots of the clock show of time, as far as there is a motion. */
    range() {
      const [first, last] = [this.time[0], this.time[this.time.length - 1]];
      const [from, to] = this.clock.range || [first, last];
      return from < last && to > first ? [Math.max(first, from), Math.min(last, to)] : [first, last];
    }

    /** Moves by itself only where that is wanted; elsewhere each press is a moment further. */
    press() {
      const [first, last] = this.range();
      const ended = this.now >= last - 1e-9 * (last - first) || this.now < first;
      if (reduced.matches) return this.seek(ended ? first : Math.min(last, this.now + (last - first) / 20));
      if (this.playing) return this.stop();
      if (ended) this.now = first;
      this.playing = true;
      this.clock.player = this;
      this.button.textContent = 'Pause';
      let before = null;
      const step = at => {
        if (!this.playing) return;
        // A page that was away goes on where it was.
        const passed = before === null ? 0 : Math.min(0.1, (at - before) / 1000);
        before = at;
        const end = this.range()[1];
        this.seek(Math.min(end, this.now + passed * this.pace.value));
        if (this.now >= end) return this.stop();
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }
    stop() {
      this.playing = false;
      if (this.clock.player === this) this.clock.player = null;
      this.button.textContent = reduced.matches ? 'Next moment' : 'Play';
      this.pace.hidden = reduced.matches;
    }
    seek(time) {
      this.now = time;
      this.clock.at(time, this);
    }

    // What a clock asks of its plots.
    refresh() { this.point(this.now); }
    point(time) {
      if (time >= this.time[0] && time <= this.time[this.time.length - 1]) this.now = time;
      const [first, last] = this.range();
      this.slider.value = Math.round(1000 * (this.now - first) / (last - first || 1));
      const told = [`${number(this.now)} s`, ...this.data.values.map(
          ({label, unit, values}) => `${label} ${number(this.at(values))} ${unit}`)];
      this.slider.setAttribute('aria-valuetext', told.join(', '));
      this.said.textContent = told.join(' · ');
      this.draw();
    }
    restyle() { this.draw(); }

    /** A column's value now. */
    at(column) {
      if (!column) return 0;
      const {time} = this;
      const next = Math.min(Math.max(1, flyball.lower(time, this.now)), time.length - 1);
      if (!next) return column[0];
      const share = (this.now - time[next - 1]) / (time[next] - time[next - 1]);
      return column[next - 1] + share * (column[next] - column[next - 1]);
    }

    /** Calls with where a part's outline is on its way, row by row; with nulls where the pen lifts. */
    trace(part, values, visit) {
      const [dx, dy, angle] = values;
      const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
      for (let i = 0; i < part.x.length; ++i) {
        const [x, y] = [part.x[i], part.y[i]];
        Number.isFinite(x) ? visit(dx + cos * x - sin * y, dy + sin * x + cos * y) : visit(null);
      }
    }

    /** What the whole motion takes. */
    all() {
      const view = {x: [Infinity, -Infinity], y: [Infinity, -Infinity]};
      const see = (axis, value) => {
        axis[0] = Math.min(axis[0], value);
        axis[1] = Math.max(axis[1], value);
      };
      const stride = Math.ceil(this.time.length / 200);
      for (let row = 0; row < this.time.length; row += stride) {
        for (const part of this.data.parts) {
          const values = [part.toX, part.toY, part.angle].map(column => column ? column[row] : 0);
          this.trace(part, values, (x, y) => {
            if (x === null) return;
            see(view.x, x);
            see(view.y, y);
          });
        }
      }
      return view;
    }

    resize() {
      const width = this.canvas.parentNode.clientWidth;
      if (!width || width === this.width) return;
      this.width = width;
      this.height = Math.min(260, Math.max(160, width));
      const scale = window.devicePixelRatio || 1;
      Object.assign(this.canvas, {width: width * scale, height: this.height * scale});
      Object.assign(this.canvas.style, {width: `${width}px`, height: `${this.height}px`});
      this.point(this.now);
    }

    draw() {
      if (!this.width) return;
      const c = this.canvas.getContext('2d');
      const scale = window.devicePixelRatio || 1;
      const {x, y} = this.extent;
      const unit = Math.min((this.width - 2 * margin) / (x[1] - x[0] || 1), (this.height - 2 * margin) / (y[1] - y[0] || 1));
      const px = v => this.width / 2 + unit * (v - (x[0] + x[1]) / 2);
      const py = v => this.height / 2 - unit * (v - (y[0] + y[1]) / 2);
      c.setTransform(scale, 0, 0, scale, 0, 0);
      c.clearRect(0, 0, this.width, this.height);
      c.lineJoin = 'round';
      for (const part of this.data.parts) {
        c.beginPath();
        let open = false;
        this.trace(part, [part.toX, part.toY, part.angle].map(column => this.at(column)), (x, y) => {
          if (x !== null) open ? c.lineTo(px(x), py(y)) : c.moveTo(px(x), py(y));
          open = x !== null;
        });
        const ground = part.style === 'ground';
        c.strokeStyle = c.fillStyle = flyball.color(ground ? 'mark' : `c${part.color}`);
        c.lineWidth = ground ? 1.2 : 1.8;
        c.setLineDash(part.style === 'outlined' ? [5, 4] : []);
        if (part.style === 'filled') {
          c.globalAlpha = 0.3;
          c.fill('evenodd');
          c.globalAlpha = 1;
        }
        c.stroke();
      }
      c.setLineDash([]);
    }
  };
})();
