// Makes the page's plots as they come into view, and a button to copy each piece of code.
(() => {
  const {make} = flyball;
  const ascending = x => {
    for (let i = 0; i < x.length; ++i) if (!(i === 0 ? Number.isFinite(x[0]) : x[i] >= x[i - 1])) return false;
    return true;
  };

  function build(element) {
    const figure = flyball.unpack(JSON.parse(element.querySelector('script').textContent));
    const live = make('div', {className: 'live', tabIndex: 0});
    live.setAttribute('role', 'group');
    live.setAttribute('aria-label', figure.title);
    element.prepend(live);
    element.classList.add('on');
    const curves = figure.panels.flatMap(panel => [...panel.lines, ...panel.bands]);
    const over_x = !figure.equal && !figure.circle && figure.panels.every(panel => !panel.ticks.length) &&
        curves.some(({x}) => x.length) && curves.every(({x}) => ascending(x));
    const plot = new (over_x ? flyball.TimePlot : flyball.XyPlot)(figure, live);
    const keys = {'+': () => plot.zoom(0.7), '-': () => plot.zoom(1 / 0.7), '0': () => plot.reset(),
                  ArrowLeft: () => plot.pan(-0.1), ArrowRight: () => plot.pan(0.1)};
    live.addEventListener('keydown', event => {
      if (event.target !== live || event.ctrlKey || event.metaKey || !keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
    flyball.all.push(plot);
    element.plot = plot;
  }

  function animate(element) {
    const data = flyball.drawing(JSON.parse(element.querySelector('script').textContent));
    const live = make('div', {className: 'live'});
    live.setAttribute('role', 'group');
    live.setAttribute('aria-label', data.title);
    element.prepend(live);
    element.classList.add('on');
    element.plot = new flyball.Animation(data, live);
    flyball.animations.push(element.plot);
  }

  function open(element) {
    if (element.plot !== undefined) return;
    element.plot = null;
    element.classList.remove('waiting');
    try {
      element.matches('.animation') ? animate(element) : build(element);
    } catch (problem) {
      // The still picture stays.
      element.classList.remove('on');
      element.querySelector('.live')?.remove();
      console.error(problem);
    }
  }

  const figures = [...document.querySelectorAll('figure.plot, figure.animation')];
  flyball.open_all = () => figures.forEach(open);
  const near = new IntersectionObserver(entries => {
    for (const {isIntersecting, target} of entries) {
      if (!isIntersecting) continue;
      near.unobserve(target);
      open(target);
    }
    if (!performance.getEntriesByName('interactive').length) performance.mark('interactive');
  }, {rootMargin: '300px'});
  // What has no box comes into no view: a drawing has none before it is opened, but a place.
  figures.filter(figure => figure.matches('.animation')).forEach(figure => figure.classList.add('waiting'));
  figures.forEach(figure => near.observe(figure));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', 
      () => [...flyball.all, ...flyball.animations].forEach(plot => plot.restyle()));

  if (figures.length) {
    const fingers = matchMedia('(pointer: coarse)').matches;
    document.querySelector('nav').after(make('p', {className: 'hint', textContent: fingers
        ? 'Plots: two fingers zoom, one moves sideways, two taps show all; a tap on a name hides its curve.'
        : 'Plots: drag to zoom, shift and drag to move, double-click to show all; Ctrl and the wheel zoom too. ' +
          'A click on a name hides its curve.'}));
  }

  for (const code of document.querySelectorAll('pre')) {
    const button = make('button', {type: 'button', className: 'copy', textContent: 'Copy'});
    button.addEventListener('click', async () => {
      let done = true;
      try {
        await navigator.clipboard.writeText(code.textContent);
      } catch {
        getSelection().selectAllChildren(code);
        done = document.execCommand('copy');
      }
      button.textContent = done ? 'Copied' : 'Press Ctrl+C';
      setTimeout(() => { button.textContent = 'Copy'; }, 2000);
    });
    code.before(button);
  }
})();
