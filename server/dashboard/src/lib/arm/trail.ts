/** The way of the arm's end, as a line that fades with age. */

import { BufferAttribute, BufferGeometry, Color, Line, LineBasicMaterial } from 'three';
import type { Vector } from './chain';

const CAPACITY = 2000;
/** m between two points: what moves less is not drawn again. */
const FINENESS = 0.001;

export class Trail {
  readonly line: Line;
  private readonly positions = new Float32Array(3 * CAPACITY);
  private readonly colours = new Float32Array(4 * CAPACITY);
  private readonly geometry = new BufferGeometry();
  private readonly material = new LineBasicMaterial({
    vertexColors: true,
    transparent: true,
    depthWrite: false,
  });
  private colour = new Color();
  private count = 0;
  private isPainted = false;

  constructor() {
    this.geometry.setAttribute('position', new BufferAttribute(this.positions, 3));
    this.geometry.setAttribute('color', new BufferAttribute(this.colours, 4));
    this.line = new Line(this.geometry, this.material);
    this.line.frustumCulled = false;
    this.paint();
  }

  /** Takes in where the end is now; true when the line has become longer. */
  add(point: Vector): boolean {
    if (this.count > 0 && this.distanceToLast(point) < FINENESS) return false;
    if (this.count === CAPACITY) {
      this.positions.copyWithin(0, 3 * (CAPACITY / 2));
      this.count = CAPACITY / 2;
    }
    this.positions.set(point, 3 * this.count++);
    this.isPainted = false;
    return true;
  }

  clear(): void {
    this.count = 0;
    this.isPainted = false;
  }

  setColour(colour: string): void {
    this.colour = new Color(colour);
    this.isPainted = false;
  }

  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }

  /** Takes over what has changed, before it is drawn. */
  paint(): void {
    if (this.isPainted) return;
    this.isPainted = true;
    for (let index = 0; index < this.count; index++) {
      const fresh = (index + 1) / this.count;
      this.colours.set([this.colour.r, this.colour.g, this.colour.b, fresh * fresh], 4 * index);
    }
    this.geometry.setDrawRange(0, this.count);
    this.geometry.attributes.position!.needsUpdate = true;
    this.geometry.attributes.color!.needsUpdate = true;
  }

  private distanceToLast(point: Vector): number {
    const at = 3 * (this.count - 1);
    return Math.hypot(...point.map((value, index) => value - this.positions[at + index]!));
  }
}
