/** The controller's gains: as it has them, and as they are being changed. What asks the service is handed in. */

import { asProblem, type Problem } from '../api/problem';
import { typedNumber, type NumberRule } from '../trajectory/numbers';

/** P, I, D of every joint (from 1), as the controller has them. */
export type Gains = Readonly<Record<string, readonly number[]>>;

export const TERMS = ['P', 'I', 'D'] as const;
/** The controller takes whole numbers from 0 to 20; they are not physical gains. */
const RULE: NumberRule = {
  bounds: { low: 0, high: 20, above: false },
  unit: '',
  scale: 1,
  integer: true,
};

export interface GainRequests {
  read(): Promise<Gains>;
  /** Writes those of the joints named. All, as read back. */
  write(gains: Gains): Promise<Gains>;
}

export class GainTable {
  /** Null until they are known. */
  known = $state.raw<Gains | null>(null);
  /** What is in the fields, by joint. */
  typed: Record<string, [string, string, string]> = $state({});
  problem = $state.raw<Problem | null>(null);
  busy = $state(false);
  /** What became of the last writing. */
  done = $state('');

  constructor(private readonly requests: GainRequests) {}

  /** Why a field is wrong; empty where it is not. */
  wrong(joint: string, term: number): string {
    return typedNumber(this.typed[joint]?.[term] ?? '', RULE).problem;
  }

  /** Joints whose fields differ from what the controller has. */
  changed: readonly string[] = $derived.by(() =>
    Object.entries(this.known ?? {})
      .filter(([joint, gains]) =>
        gains.some((gain, term) => this.typed[joint]?.[term]?.trim() !== String(gain)),
      )
      .map(([joint]) => joint),
  );

  isWritable: boolean = $derived.by(
    () =>
      this.changed.length > 0 &&
      this.changed.every((joint) => TERMS.every((_, term) => !this.wrong(joint, term))),
  );

  /** Joints that nothing would hold any more: P is 0. */
  limp: readonly string[] = $derived.by(() =>
    this.changed.filter((joint) => Number(this.typed[joint]?.[0]) === 0),
  );

  /** What is in the controller into the fields. */
  async read(): Promise<void> {
    await this.asked(() => this.requests.read());
  }

  /** Writes what differs. */
  async write(): Promise<void> {
    if (!this.isWritable) return;
    const joints = this.changed;
    const gains = Object.fromEntries(joints.map((joint) => [joint, this.typed[joint]!.map(Number)]));
    if (await this.asked(() => this.requests.write(gains)))
      this.done = `joint${joints.length === 1 ? '' : 's'} ${joints.join(', ')}: written and read back`;
  }

  private async asked(request: () => Promise<Gains>): Promise<boolean> {
    if (this.busy) return false;
    this.busy = true;
    this.done = '';
    try {
      this.known = await request();
      this.typed = Object.fromEntries(
        Object.entries(this.known).map(([joint, gains]) => [
          joint,
          gains.map(String) as [string, string, string],
        ]),
      );
      this.problem = null;
      return true;
    } catch (error) {
      this.problem = asProblem(error);
      return false;
    } finally {
      this.busy = false;
    }
  }
}
