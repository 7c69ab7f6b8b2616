/** The layouts of the person who is here, kept in this browser under their name, and the one that is shown. */

import { layoutOf, STANDARD, written, type Layout, type LayoutPanel } from './layout';

interface Kept {
  chosen: string;
  layouts: unknown[];
}

class Layouts {
  own = $state.raw<readonly Layout[]>([]);
  chosen = $state('');
  /** One that came with a link: looked at, and not yet one's own. */
  shared = $state.raw<Layout | null>(null);
  problem = $state('');
  shown: Layout = $derived(this.shared ?? this.own.find((one) => one.name === this.chosen) ?? STANDARD);
  isOwn: boolean = $derived(this.own.includes(this.shown));
  private key = '';

  /** Shows the layouts of this person. What is kept and no layout any more is left out, and said. */
  follow(person: string): void {
    this.key = `ma2000-layouts:${person}`;
    this.own = [];
    this.problem = '';
    try {
      const kept = JSON.parse(localStorage.getItem(this.key) ?? '{}') as Partial<Kept>;
      this.own = (kept.layouts ?? []).map((one) => layoutOf(JSON.stringify(one)));
      this.chosen = typeof kept.chosen === 'string' ? kept.chosen : '';
    } catch (error) {
      this.problem = `The layouts that this browser keeps cannot be read: ${(error as Error).message}.`;
    }
  }

  choose(name: string): void {
    this.shared = null;
    this.chosen = name;
    this.keep();
  }

  /** Keeps a layout in the place of the one called `former`, and shows it. Its name is made one that no other has. */
  save(layout: Layout, former: string | null): void {
    const others = this.own.filter((one) => one.name !== former);
    const taken = new Set([STANDARD.name, ...others.map((one) => one.name)]);
    let name = layout.name;
    for (let count = 2; taken.has(name); count += 1) name = `${layout.name} ${count}`;
    this.own = [...others, { ...layout, name }].sort((a, b) => a.name.localeCompare(b.name));
    this.choose(name);
  }

  /** Another text in the notes of the layout that is shown. */
  note(panel: LayoutPanel, text: string): void {
    const panels = this.shown.panels.map((one) => (one.id === panel.id ? { ...one, text } : one));
    if (this.isOwn) this.save({ name: this.shown.name, panels }, this.shown.name);
  }

  remove(name: string): void {
    this.own = this.own.filter((one) => one.name !== name);
    this.choose('');
  }

  private keep(): void {
    const kept: Kept = {
      chosen: this.chosen,
      layouts: this.own.map((one) => JSON.parse(written(one)) as unknown),
    };
    try {
      localStorage.setItem(this.key, JSON.stringify(kept));
      this.problem = '';
    } catch {
      this.problem = 'This browser keeps nothing for this page: save the layout as a file.';
    }
  }
}

export const layouts = new Layouts();
