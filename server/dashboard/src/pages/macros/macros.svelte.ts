/** Macros: those that are kept, the one that is filled in or edited, and its experiments on their way to the queue. */

import {
  api,
  ask,
  asProblem,
  here,
  newKey,
  type ExperimentSpec,
  type KeptMacro,
  type Macro,
  type MacroReading,
  type Problem,
} from '../../lib/api';
import { duration } from '../../lib/format';
import { live } from '../../lib/live/live.svelte';
import { fieldsOf, valuesOf, type MacroField } from '../../lib/macros/form';
import { previewOf, submit, toldMotion } from '../../lib/queue/submit';

/** One experiment of a macro: its line, what it moves, and what is wrong with it. */
export interface Step {
  readonly line: string;
  readonly told: readonly string[];
  readonly violations: readonly string[];
}

const EMPTY: Macro = { name: '', description: '', parameters: [], lines: [''] };

export class MacroDesk {
  kept = $state.raw<readonly KeptMacro[]>([]);
  examples = $state.raw<readonly Macro[]>([]);
  /** The macro that is shown; null before the first is chosen. */
  macro = $state.raw<Macro | null>(null);
  /** Its revision; null while it is not kept. */
  revision = $state.raw<number | null>(null);
  isEdited = $state(false);
  fields = $state.raw<readonly MacroField[]>([]);
  typed = $state<Record<string, string>>({});
  steps = $state.raw<readonly Step[]>([]);
  /** What became of the last run, or of the last change. */
  done = $state('');
  busy = $state(false);
  problem = $state.raw<Problem | null>(null);
  filled = $derived(valuesOf(this.fields, this.typed));
  isWrong = $derived(Object.keys(this.filled.problems).length > 0);
  /** What its lines ask for, and how many of them have been handed over. */
  private orders = $state.raw<MacroReading['orders']>([]);
  /** How often values were filled in: a check is of those that it began with. */
  private changes = 0;
  sent = $state(0);
  /** How many of them are planned to be repeated. */
  planned = $derived(this.orders.filter((one) => one.cron !== null).length);
  /** What adding them does. */
  adding = $derived(
    this.planned === 0
      ? 'Add to the queue'
      : this.planned < this.orders.length
        ? 'Add to queue and plan'
        : `Add the schedule${this.planned > 1 ? 's' : ''}`,
  );

  /** Asks for the macros, and shows the first. Throws a Problem. */
  async load(): Promise<void> {
    const found = await ask(api.GET('/api/v1/robots/{robot}/macros', { params: { path: here() } }));
    this.kept = found.kept;
    this.examples = found.examples;
    const first = found.kept[0];
    if (this.macro !== null) return;
    if (first) await this.show(first.macro, first.revision);
    else if (found.examples[0]) await this.show(found.examples[0], null);
  }

  /** Shows a macro's form, filled with its defaults. */
  async show(macro: Macro, revision: number | null): Promise<void> {
    this.macro = macro;
    this.revision = revision;
    this.isEdited = false;
    this.typed = {};
    this.orders = [];
    this.forget();
    await this.during(async () => {
      const reading = await readDraft(macro);
      this.fields = fieldsOf(reading.parameters);
      this.orders = reading.orders;
    });
  }

  /** Fills one field. */
  fill(name: string, value: string): void {
    this.typed[name] = value;
    this.forget();
    this.problem = null;
  }

  /** What was checked or sent with other values is no longer told, nor is what is being checked. */
  private forget(): void {
    this.changes += 1;
    this.steps = [];
    this.sent = 0;
    this.done = '';
  }

  /** Edits the macro shown, a copy of it, or a new one. */
  edit(macro: Macro = EMPTY, revision: number | null = null): void {
    this.macro = macro;
    this.revision = revision;
    this.isEdited = true;
    this.problem = null;
    this.done = '';
  }

  /** What was typed in the editor; what was wrong before is no longer told. */
  change(macro: Macro): void {
    this.macro = macro;
    this.problem = null;
  }

  /** Begins a macro with the line of an experiment that has ended. */
  async editFrom(experiment: string): Promise<void> {
    await this.during(async () => {
      const params = { path: { ...here(), experiment } };
      const { line } = await ask(api.GET('/api/v1/robots/{robot}/experiments/{experiment}/line', { params }));
      this.edit({ ...EMPTY, lines: [line] });
    });
  }

  /** Keeps the macro that is edited. */
  async keep(): Promise<void> {
    const macro = this.macro;
    if (macro === null) return;
    await this.during(async () => {
      const params = {
        path: { ...here(), macro: macro.name },
        query: this.revision === null ? {} : { revision: this.revision },
      };
      const kept = await ask(api.PUT('/api/v1/robots/{robot}/macros/{macro}', { params, body: macro }));
      await this.load();
      await this.show(kept.macro, kept.revision);
      this.done = `${kept.macro.name} is kept`;
    });
  }

  async remove(): Promise<void> {
    const macro = this.macro?.name;
    if (macro === undefined) return;
    await this.during(async () => {
      const params = { path: { ...here(), macro } };
      await ask(api.DELETE('/api/v1/robots/{robot}/macros/{macro}', { params }));
      this.macro = null;
      await this.load();
    });
  }

  /** Has every motion worked out; nothing is sent. Whether all of them are allowed. */
  async check(): Promise<boolean> {
    let isAllowed = false;
    this.forget();
    const began = this.changes;
    await this.during(async () => {
      const reading = await this.read();
      this.orders = reading.orders;
      const steps: Step[] = [];
      let seconds = 0;
      for (const [place, order] of reading.orders.entries()) {
        const motion = await previewOf(order.spec as unknown as ExperimentSpec);
        const { lines: told, violations } = toldMotion(order, motion, live.machine, live.wall);
        steps.push({ line: reading.lines[place] ?? '', told, violations });
        seconds += motion.duration;
      }
      if (began !== this.changes) throw new Error('a value was changed meanwhile; nothing was sent');
      this.steps = steps;
      isAllowed = steps.every((one) => one.violations.length === 0);
      this.done = isAllowed ? `${duration(seconds)} in all; no limit is violated; nothing was sent` : '';
    });
    return isAllowed;
  }

  /** Checks all experiments, then adds them to the queue in their order. */
  async run(): Promise<void> {
    if (!(await this.check())) return;
    this.done = '';
    await this.during(async () => {
      const { orders } = this;
      for (const [place, order] of orders.entries()) {
        const told = await submit(order, newKey(), live.wall);
        this.sent = place + 1;
        this.done = orders.length === 1 ? told : `${this.sent} of ${orders.length} were added, in this order`;
      }
    });
  }

  private read(): Promise<MacroReading> {
    const macro = this.macro ?? EMPTY;
    const { values } = this.filled;
    if (this.revision === null)
      // Not kept: its values stand in place of its defaults.
      return readDraft({
        ...macro,
        parameters: macro.parameters.map((one) => ({
          ...one,
          default: (values[one.name] ?? one.default) as string | number,
        })),
      });
    const params = { path: { ...here(), macro: macro.name } };
    return ask(api.POST('/api/v1/robots/{robot}/macros/{macro}/read', { params, body: { values } }));
  }

  private async during(work: () => Promise<void>): Promise<void> {
    this.busy = true;
    this.problem = null;
    try {
      await work();
    } catch (error) {
      this.problem = asProblem(error);
    }
    this.busy = false;
  }
}

async function readDraft(macro: Macro): Promise<MacroReading> {
  return ask(api.POST('/api/v1/robots/{robot}/macros/read', { params: { path: here() }, body: macro }));
}
