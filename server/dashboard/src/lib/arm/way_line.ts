/** A planned way through space: a line, in another colour and with marks where it is outside of what is allowed. */

import { Color, Group, Mesh, MeshBasicMaterial, OctahedronGeometry } from 'three';
import { Line2 } from 'three/examples/jsm/lines/Line2.js';
import { LineGeometry } from 'three/examples/jsm/lines/LineGeometry.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import type { Way } from '../trajectory/preview';
import type { Vector } from './chain';

/** CSS pixels. */
const WIDTH = 2.5;

export class WayLine {
  readonly group = new Group();
  private readonly material = new LineMaterial({ vertexColors: true, linewidth: WIDTH });
  private readonly mark = new MeshBasicMaterial();
  private readonly shape: OctahedronGeometry;
  private line: Line2 | null = null;

  /** `size`: of a mark, in m. */
  constructor(size: number) {
    this.shape = new OctahedronGeometry(size);
  }

  show(way: Way | null, marks: readonly Vector[], allowed: string, outside: string): void {
    this.clear();
    if (way && way.points.length > 1) {
      const [good, bad] = [new Color(allowed), new Color(outside)];
      const geometry = new LineGeometry();
      geometry.setPositions(way.points.flat());
      geometry.setColors(way.outside.flatMap((out) => (out ? bad : good).toArray()));
      this.line = new Line2(geometry, this.material);
      this.group.add(this.line);
    }
    this.mark.color.set(outside);
    for (const point of marks) {
      const mark = new Mesh(this.shape, this.mark);
      mark.position.set(...point);
      this.group.add(mark);
    }
  }

  dispose(): void {
    this.clear();
    this.material.dispose();
    this.mark.dispose();
    this.shape.dispose();
  }

  private clear(): void {
    this.line?.geometry.dispose();
    this.line = null;
    this.group.clear();
  }
}
