/** Teaching: a program is put together from postures and led paths, and run. What asks the service is handed in. */

import { asProblem, type Problem } from '../api/problem';
import type { Machine, TeachingStatus } from '../api/types';
import { ledAtFirst } from './lead';
import { moved, play, programOf, type Instruction, type Program } from './program';

export interface TeachRequests {
  run(program: Program): Promise<TeachingStatus>;
  lead(joints: readonly number[]): Promise<TeachingStatus>;
  /** Ends leading: the path is in the answer. */
  finish(): Promise<TeachingStatus>;
}

export class Teaching {
  instructions = $state.raw<readonly Instruction[]>([]);
  /** Joints that are led next. */
  chosen = $state.raw<readonly number[]>([]);
  /** Joints that this page has begun to lead; none where somebody else has. */
  led = $state.raw<readonly number[]>([]);
  /** Whether the end of leading has been asked for: the arm has to come to rest first. */
  isEnding = $state(false);
  problem = $state.raw<Problem | null>(null);

  constructor(
    private readonly machine: Machine,
    private readonly requests: TeachRequests,
  ) {
    this.chosen = ledAtFirst(machine);
  }

  keep(instruction: Instruction): void {
    this.instructions = [...this.instructions, instruction];
  }

  move(place: number, step: -1 | 1): void {
    this.instructions = moved(this.instructions, place, step);
  }

  takeAway(place: number): void {
    this.instructions = this.instructions.filter((_, other) => other !== place);
  }

  choose(joint: number): void {
    const { chosen } = this;
    this.chosen = chosen.includes(joint)
      ? chosen.filter((one) => one !== joint)
      : [...chosen, joint].sort((one, other) => one - other);
  }

  program(name: string): Program {
    return programOf(name, this.machine.name, this.instructions);
  }

  async run(name: string): Promise<void> {
    await this.tried(() => this.requests.run(this.program(name)));
  }

  async lead(): Promise<void> {
    const joints = this.chosen;
    this.led = (await this.tried(() => this.requests.lead(joints))) === null ? [] : joints;
  }

  /** What the arm does is known to be another thing: whoever leads next may lead other joints. */
  isNotLed(): void {
    this.led = [];
  }

  /** Ends leading, and keeps its path as an instruction: once, however often it is asked for. */
  async finish(): Promise<void> {
    if (this.isEnding) return;
    this.isEnding = true;
    const status = await this.tried(() => this.requests.finish());
    this.isEnding = false;
    if (status === null) return;
    this.led = [];
    const path = status.path ?? null;
    if (path !== null) this.keep(play(path));
  }

  /** Null where the service refuses. */
  private async tried(order: () => Promise<TeachingStatus>): Promise<TeachingStatus | null> {
    try {
      const status = await order();
      this.problem = null;
      return status;
    } catch (error) {
      this.problem = asProblem(error);
      return null;
    }
  }
}
