/**
 * The layouts of the person who is here, and the one that is shown. They are kept in this browser under the person's
 * name, so they are there at once, and by the service, so they are the same everywhere; the service's hold.
 */

import { LayoutError, layoutOf, STANDARD, written, type Layout, type LayoutPanel } from './layout';

/** Keeps a person's layouts at the service. */
export interface Keeper {
  /** What was kept; null where none was. */
  get(): Promise<string | null>;
  put(text: string, name: string): Promise<void>;
}

/** ms without a change before the service is told. */
const QUIET = 1000;

class Layouts {
  own = $state.raw<readonly Layout[]>([]);
  chosen = $state('');
  /** One that came with a link: looked at, and not yet one's own. */
  shared = $state.raw<Layout | null>(null);
  problem = $state('');
  shown: Layout = $derived(this.shared ?? this.own.find((one) => one.name === this.chosen) ?? STANDARD);
  isOwn: boolean = $derived(this.own.includes(this.shown));
  private key = '';
  private keeper: Keeper | null = null;
  private timer: ReturnType<typeof setTimeout> | null = null;
  /** What this browser and the service have. */
  private text = '';

  /**
   * Shows the layouts of this person. What is kept and no layout any more is left out, and said.
   *
   * `keeper`: null where the service keeps none, or has not said yet that it does.
   */
  follow(person: string, keeper: Keeper | null): void {
    const key = `ma2000-layouts:${person}`;
    if (key === this.key && keeper === this.keeper) return;
    const isOther = key !== this.key;
    this.key = key;
    this.keeper = keeper;
    if (isOther) this.take(localStorage.getItem(key) ?? '');
    if (keeper === null) return;
    if (localStorage.getItem(this.untold) !== null) {
      // The page was left, or there was no connection, before the service was told.
      void this.tell();
      return;
    }
    void keeper.get().then(
      (text) => {
        // What was changed meanwhile is told to the service soon.
        if (text === null || text === this.text || this.timer !== null || key !== this.key) return;
        this.take(text);
        localStorage.setItem(key, text);
      },
      () => {}, // this browser's hold
    );
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

  private take(text: string): void {
    this.text = text;
    this.own = [];
    this.chosen = '';
    this.problem = '';
    try {
      const kept = (text === '' ? {} : JSON.parse(text)) as { chosen?: unknown; layouts?: unknown[] };
      this.own = (kept.layouts ?? []).map((one) => layoutOf(JSON.stringify(one)));
      this.chosen = typeof kept.chosen === 'string' ? kept.chosen : '';
    } catch (error) {
      const why = error instanceof LayoutError ? error.message : 'they are no layouts';
      this.problem = `The layouts that are kept cannot be read: ${why}.`;
    }
  }

  private keep(): void {
    const layouts = this.own.map((one) => JSON.parse(written(one)) as unknown);
    this.text = JSON.stringify({ chosen: this.chosen, layouts });
    this.problem = '';
    try {
      localStorage.setItem(this.key, this.text);
      localStorage.setItem(this.untold, 'yes');
    } catch {
      this.problem = 'This browser keeps nothing for this page: save the layout as a file.';
    }
    if (this.timer !== null) clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.tell(), QUIET);
  }

  private get untold(): string {
    return `${this.key}:untold`;
  }

  private async tell(): Promise<void> {
    this.timer = null;
    if (this.keeper === null) return;
    const [text, untold] = [this.text, this.untold];
    try {
      await this.keeper.put(text, this.chosen || STANDARD.name);
      if (text === this.text) localStorage.removeItem(untold);
    } catch (error) {
      this.problem = `${(error as Error).message}.`;
    }
  }
}

export const layouts = new Layouts();
