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
import { live } from '../../lib/live/live.svelte';
import { fieldsOf, valuesOf, type MacroField } from '../../lib/macros/form';
import { previewOf, submit, toldMotion } from '../../lib/queue/submit';

/** One experiment of a macro: its line, what it moves, and what is wrong with it. */
export interface Step {
  readonly line: string;
  readonly text: string;
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
  private last: MacroReading | null = null;

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
    this.steps = [];
    this.done = '';
    await this.during(async () => {
      const reading = await readDraft(macro);
      this.fields = fieldsOf(reading.parameters);
    });
  }

  /** Edits the macro shown, a copy of it, or a new one. */
  edit(macro: Macro = EMPTY, revision: number | null = null): void {
    this.macro = macro;
    this.revision = revision;
    this.isEdited = true;
    this.problem = null;
    this.done = '';
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
      await ask(
        api.DELETE('/api/v1/robots/{robot}/macros/{macro}', { params: { path: { ...here(), macro } } }),
      );
      this.macro = null;
      await this.load();
    });
  }

  /** Has every motion worked out; nothing is sent. Whether all of them are allowed. */
  async check(): Promise<boolean> {
    let isAllowed = false;
    this.done = '';
    await this.during(async () => {
      const reading = await this.read();
      this.last = reading;
      const steps: Step[] = [];
      for (const [place, order] of reading.orders.entries()) {
        const motion = await previewOf(order.spec as unknown as ExperimentSpec);
        const repeated = order.cron === null ? '' : `, repeated (${order.cron})`;
        const { text, violations } = toldMotion(order.spec, motion);
        steps.push({ line: reading.lines[place] ?? '', text: text + repeated, violations });
      }
      this.steps = steps;
      isAllowed = steps.every((one) => one.violations.length === 0);
      this.done = isAllowed ? 'no limit is violated; nothing was sent' : '';
    });
    return isAllowed;
  }

  /** Checks all experiments, then adds them to the queue in their order. */
  async run(): Promise<void> {
    if (!(await this.check())) return;
    await this.during(async () => {
      const orders = this.last?.orders ?? [];
      let sent = 0;
      try {
        for (const order of orders) {
          await submit(order, newKey(), live.wall);
          sent += 1;
        }
      } finally {
        const all =
          orders.length === 1 ? 'the experiment was' : `${sent} of ${orders.length} experiments were`;
        this.done = sent === 0 ? '' : `${all} added; the queue runs them in this order`;
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
