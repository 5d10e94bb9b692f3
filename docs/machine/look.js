// What is wrong with the page that is shown, as sentences; `kind` says how it is shown. See browser.py.
(kind) => {
  const found = [];
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const seen = e => e.checkVisibility({ visibilityProperty: true, opacityProperty: true })
    && e.getBoundingClientRect().width > 1;
  const short = text => text.trim().replace(/\s+/g, ' ').slice(0, 40);
  const named = e => short(e.textContent) || short(e.getAttribute('aria-label') ?? '')
    || all('img', e).map(i => i.alt).join('') || all('title', e).map(t => t.textContent).join('');
  const article = document.querySelector('article');

  // As laid out: nothing wider than the screen, nothing cut that cannot be scrolled.
  const wide = document.documentElement.scrollWidth - kind.width;  // innerWidth of a telephone grows with it
  if (wide > 1) {
    const out = all('body *').filter(seen)
      .filter(e => e.getBoundingClientRect().right > kind.width + 1).pop();
    found.push(`${wide} px wider than the screen: '${out ? short(out.textContent) : '?'}'`);
  }
  for (const e of all('article pre, article .table-wrapper, article div.math, article img')) {
    const scrolls = /auto|scroll/.test(getComputedStyle(e).overflowX);
    const table = e.classList.contains('table-wrapper') && kind.width > 1000;  // there it has room
    if (seen(e) && e.scrollWidth > e.clientWidth + 2 && (kind.print || table || !scrolls))
      found.push(`cut at the right: '${short(e.textContent)}'`);
  }
  if (kind.print) return found;

  for (const m of all('math').filter(seen)) {
    if (m.getBoundingClientRect().height < 4) found.push(`formula without extent: '${m.textContent}'`);
  }
  for (const m of all('merror')) found.push(`formula in error: '${m.textContent}'`);
  for (const i of document.images)
    if (i.complete && !i.naturalWidth) found.push(`picture does not show: ${i.src}`);

  // Colours: letters on what lies below them, pictures drawn on white.
  const colour = text => {
    const n = (text.match(/-?[\d.]+(e-?\d+)?/g) ?? []).map(Number);
    const unit = text.startsWith('color(') ? 255 : 1;
    return [n[0] * unit, n[1] * unit, n[2] * unit, n.length > 3 ? n[3] : 1];
  };
  const over = (top, below) => [0, 1, 2].map(k => top[3] * top[k] + (1 - top[3]) * below[k]);
  const ground = e => {
    if (!e) return [255, 255, 255];
    const own = colour(getComputedStyle(e).backgroundColor);
    return own[3] === 1 ? own.slice(0, 3) : over(own, ground(e.parentElement));
  };
  const light = rgb => {
    const [r, g, b] = rgb.map(c => c / 255).map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const contrast = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  const told = new Set();
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walk.nextNode(); node; node = walk.nextNode()) {
    const e = node.parentElement;
    if (!node.data.trim() || /SCRIPT|STYLE|NOSCRIPT/.test(e.tagName) || e.closest('[aria-hidden=true], svg')) continue;
    const style = getComputedStyle(e), below = ground(e);
    const key = [style.color, below, style.fontSize, style.fontWeight].join();
    if (told.has(key) || !seen(e)) continue;
    told.add(key);
    const size = parseFloat(style.fontSize), big = size >= 24 || (size >= 18.6 && style.fontWeight >= 700);
    const ratio = contrast(light(over(colour(style.color), below)), light(below));
    if (ratio < (big ? 3 : 4.5) - 0.05)
      found.push(`contrast of ${ratio.toFixed(1)} only, ${style.color} on ${below.map(Math.round)}: '${short(node.data)}'`);
  }
  for (const i of all('article img').filter(seen))
    if (light(ground(i)) < 0.5 && !i.src.endsWith('.svg')) found.push(`picture drawn for white stands on dark: ${i.src}`);

  if (!kind.structure) return found;
  // As read to those who do not see it.
  const words = article?.innerText.length ?? 0;
  if (words < 40 && !kind.quiet) found.push('hardly a word on it');
  if (!document.documentElement.lang) found.push('says not in which language it is');
  if (!document.title.trim()) found.push('has no title');
  if (!document.querySelector('main, [role=main]')) found.push('has no main part');
  for (const i of all('article img')) if (!i.alt.trim()) found.push(`picture without a text in its place: ${i.src}`);
  for (const e of all('a[href], button').filter(seen)) if (!named(e)) found.push(`link or button without a name: ${e.outerHTML.slice(0, 80)}`);
  const heads = all('h1, h2, h3, h4, h5, h6', article ?? document).map(h => [Number(h.tagName[1]), short(h.textContent)]);
  if (heads.filter(([level]) => level === 1).length !== 1 && !kind.quiet) found.push(`${heads.filter(([level]) => level === 1).length} headings of the first level`);
  heads.forEach(([level, text], k) => {
    if (k && level > heads[k - 1][0] + 1) found.push(`heading '${text}' skips a level`);
    if (!text.replace('¶', '').replace('#', '').trim()) found.push('heading without words');
  });
  const ids = all('[id]').map(e => e.id);
  for (const id of new Set(ids.filter((id, k) => ids.indexOf(id) !== k))) found.push(`two places of the name '${id}'`);
  return found;
}
