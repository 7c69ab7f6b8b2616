/** The arm in 3-D. Draws when something has changed and not otherwise; loaded only where a page shows it. */

import {
  Color,
  DirectionalLight,
  GridHelper,
  Group,
  HemisphereLight,
  type LineBasicMaterial,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  Scene,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { FrameBudget } from '../drawing/budget';
import type { Way } from '../trajectory/preview';
import { reachOf, tipOf, type Chain, type Vector } from './chain';
import type { ArmColours } from './colours';
import { ArmFigure, type FigureMaterials } from './figure';
import type { PlacedMesh } from './geometries';
import { farthest, metresOfPixel, outlineOf } from './motion';
import { Trail } from './trail';
import { cameraAt, fittingDistance, turned, viewFrom, viewNamed, type View, type ViewName } from './views';
import { WayLine } from './way_line';

const FIELD_OF_VIEW = 32;
/** What has to be in the picture around its middle, as a share of the reach: arm and hand in nearly any posture. */
const SHOWN = 1.03;
/** How high the hand reaches, as a share of the reach. */
const TOP = 1.25;
/** m. */
const GRID_SQUARE = 0.1;
const FINEST_PIXELS = 2;
/** Size of the hand as a share of the reach: what of it moves when the last joint turns. */
const HAND = 0.2;
/** px that something has to move to be drawn anew. */
const VISIBLE = 0.5;
/** Without a graphics card: share of the time for drawing the arm, s between two drawings at least and at most. */
const SPARED = [0.12, 0.08, 1] as const;

/** ms between two looks at whether a picture is drawn. */
const LOOK_EVERY = 4;
/** s after which it is no longer waited for one. */
const GIVE_UP = 2;

/** What is shown. Postures in rad, one value a joint. */
export interface ArmPicture {
  readonly posture: readonly number[] | null;
  /** Where the arm is told to be, or where a limit is broken. */
  readonly ghost?: readonly number[] | null;
  readonly ghostIsViolation?: boolean;
  readonly way?: Way | null;
  readonly marks?: readonly Vector[];
  readonly trail?: boolean;
  readonly stale?: boolean;
  readonly closed?: boolean;
  /** By joint, 0 to 1: how much of its motion nothing explains. The joints then have no colours of their own. */
  readonly heat?: readonly number[] | null;
}

/** Raises an Error where the browser has no WebGL. */
export class ArmScene {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 20);
  private readonly controls: OrbitControls;
  private readonly observer: ResizeObserver;
  private readonly arm: ArmFigure;
  private readonly ghost: ArmFigure;
  private readonly shadow: ArmFigure;
  private readonly trail = new Trail();
  private readonly wayLine: WayLine;
  private readonly ground = new Group();
  private readonly groundMaterial = new MeshBasicMaterial();
  private readonly shadowMaterial = new MeshBasicMaterial();
  private readonly ghostMaterial = new MeshLambertMaterial({
    transparent: true,
    opacity: 0.32,
    depthWrite: false,
  });
  private readonly materials: { links: MeshLambertMaterial[]; body: MeshLambertMaterial };
  private readonly target: Vector;
  private readonly floor: number;
  private shown: ArmPicture = { posture: null };
  /** Arm and ghost as they are on the screen. */
  private drawn: { arm: Vector[] | null; ghost: Vector[] | null } = { arm: null, ghost: null };
  private frame = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;
  private readonly budget: FrameBudget | null;
  /** Whether something has changed while a picture was being drawn. */
  private isAwaited = false;
  private isDisposed = false;
  private chosen: ViewName | null = 'corner';
  private worn: readonly PlacedMesh[] = [];

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly chain: Chain,
    floor: number | null,
    private colours: ArmColours,
    /** Whether the processor draws: coarser, and only as often as leaves time for the charts. */
    spared: boolean,
  ) {
    this.budget = spared ? new FrameBudget(...SPARED) : null;
    this.renderer = new WebGLRenderer({
      canvas,
      antialias: !spared,
      alpha: true,
      powerPreference: 'low-power',
    });
    this.renderer.debug.checkShaderErrors = false; // to ask for errors would wait for the compiler
    const reach = this.reach;
    this.floor = floor ?? -0.6 * reach;
    this.target = [0, 0, (this.floor + TOP * reach) / 2];
    this.materials = { links: chain.map(() => new MeshLambertMaterial()), body: new MeshLambertMaterial() };
    this.arm = new ArmFigure(chain, this.materials, this.floor);
    this.ghost = new ArmFigure(chain, all(chain, this.ghostMaterial), null);
    this.shadow = new ArmFigure(chain, all(chain, this.shadowMaterial), null);
    this.wayLine = new WayLine(0.028 * reach);
    this.build();
    this.camera.up.set(0, 0, 1);
    this.controls = this.orbit();
    this.setColours(colours);
    this.show(this.shown);
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas);
    this.resize();
  }

  show(picture: ArmPicture): void {
    const before = this.shown;
    this.shown = picture;
    const { posture, ghost } = picture;
    this.arm.group.visible = this.shadow.group.visible = posture !== null;
    this.ghost.group.visible = Boolean(ghost);
    if (posture && picture.trail) this.trail.add(tipOf(this.chain, posture));
    if (picture.closed !== before.closed) this.arm.grip(picture.closed ?? false);
    if (picture.trail !== before.trail && !picture.trail) this.trail.clear();
    if (picture.way !== before.way || picture.marks !== before.marks) this.showWay();
    const isRepainted = (['stale', 'ghostIsViolation', 'heat'] as const).some(
      (part) => picture[part] !== before[part],
    );
    if (isRepainted) this.paint();
    if (this.isVisibleChange(before)) this.invalidate();
  }

  /** After a change of the theme. */
  setColours(colours: ArmColours): void {
    this.colours = colours;
    this.paint();
    this.showWay();
    this.invalidate();
  }

  look(name: ViewName): void {
    this.chosen = name;
    this.place(viewNamed(name, this.fitting));
  }

  /** Turns by angles (rad) about the target; `zoom` < 1 comes nearer. */
  turn(azimuth: number, elevation: number, zoom: number): void {
    this.chosen = null;
    const { x, y, z } = this.camera.position;
    this.place(turned(viewFrom([x, y, z], this.target), azimuth, elevation, zoom, this.fitting));
  }

  /** Shows the robot's own meshes in place of the plain arm, and disposes of them at the end. */
  wear(meshes: readonly PlacedMesh[]): void {
    this.worn = meshes;
    for (const figure of [this.arm, this.ghost, this.shadow]) figure.wear(meshes);
    this.invalidate();
  }

  clearTrail(): void {
    this.trail.clear();
    this.invalidate();
  }

  dispose(): void {
    this.isDisposed = true;
    cancelAnimationFrame(this.frame);
    if (this.timer !== null) clearTimeout(this.timer);
    this.observer.disconnect();
    this.controls.dispose();
    for (const part of [this.arm, this.ghost, this.shadow, this.trail, this.wayLine]) part.dispose();
    for (const { geometry } of this.worn) geometry.dispose();
    this.disposeGround();
    this.renderer.dispose();
  }

  private get reach(): number {
    return reachOf(this.chain) || 1;
  }

  /** Along one side of the ground: a little more than the arm reaches. */
  private get squares(): number {
    return 2 * Math.ceil((1.1 * this.reach) / GRID_SQUARE);
  }

  private get fitting(): number {
    return fittingDistance(SHOWN * this.reach, (FIELD_OF_VIEW * Math.PI) / 180, this.camera.aspect);
  }

  private build(): void {
    const sun = new DirectionalLight(0xffffff, 2.8);
    sun.position.set(-1, -2, 3);
    this.scene.add(new HemisphereLight(0xffffff, 0xb0b8c4, 2.4), sun);
    this.scene.add(this.ground, this.shadow.group, this.arm.group, this.trail.line, this.wayLine.group);
    this.scene.add(this.ghost.group);
    const side = this.squares * GRID_SQUARE;
    const plane = new Mesh(new PlaneGeometry(side, side), this.groundMaterial);
    plane.position.z = this.floor - 0.002;
    this.ground.add(plane);
    this.shadow.group.scale.z = 1e-4;
    this.shadow.group.position.z = this.floor + 0.001;
  }

  private orbit(): OrbitControls {
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.enablePan = false;
    controls.enableZoom = false;
    controls.target.set(...this.target);
    controls.addEventListener('change', () => this.invalidate());
    controls.addEventListener('start', () => (this.chosen = null));
    // A page that is scrolled over the picture must not be caught by it: the wheel zooms once the picture is chosen.
    this.canvas.addEventListener('focus', () => (controls.enableZoom = true));
    this.canvas.addEventListener('blur', () => (controls.enableZoom = false));
    return controls;
  }

  private place(view: View): void {
    this.camera.position.set(...cameraAt(view, this.target));
    this.controls.minDistance = 0.35 * this.fitting;
    this.controls.maxDistance = 3 * this.fitting;
    this.controls.update();
    this.invalidate();
  }

  private paint(): void {
    const { colours, shown } = this;
    const hot = new Color(colours.outside);
    this.materials.links.forEach((material, index) => {
      const own = shown.heat ? colours.body : (colours.joints[index] ?? colours.body);
      material.color.set(shown.stale ? colours.stale : own).lerp(hot, shown.heat?.[index] ?? 0);
    });
    this.materials.body.color.set(shown.stale ? colours.stale : colours.body);
    this.ghostMaterial.color.set(shown.ghostIsViolation ? colours.outside : colours.ghost);
    this.shadowMaterial.color.set(colours.shadow);
    this.groundMaterial.color.set(colours.ground);
    this.trail.setColour(colours.trail);
    this.regrid();
  }

  private showWay(): void {
    const { way = null, marks = [] } = this.shown;
    this.wayLine.show(way, marks, this.colours.trail, this.colours.outside);
  }

  /** A grid has its colours in its geometry: another theme needs another one. */
  private regrid(): void {
    const before = this.ground.children.find((child) => child instanceof GridHelper);
    if (before) this.ground.remove(disposed(before));
    const grid = new GridHelper(
      this.squares * GRID_SQUARE,
      this.squares,
      this.colours.grid,
      this.colours.grid,
    );
    grid.rotation.x = Math.PI / 2;
    grid.position.z = this.floor;
    this.ground.add(grid);
  }

  private disposeGround(): void {
    for (const child of this.ground.children) {
      if (child instanceof GridHelper) disposed(child);
      else if (child instanceof Mesh) child.geometry.dispose();
    }
    this.groundMaterial.dispose();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(this.budget ? 1 : Math.min(devicePixelRatio, FINEST_PIXELS));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.chosen) this.look(this.chosen);
    this.draw();
  }

  /** Whether the picture differs from the one on the screen by more than a part of a pixel. */
  private isVisibleChange(before: ArmPicture): boolean {
    const { shown, drawn, camera, renderer } = this;
    const others = ['stale', 'closed', 'way', 'marks', 'ghostIsViolation', 'trail', 'heat'] as const;
    if (others.some((part) => shown[part] !== before[part])) return true;
    const distance = camera.position.distanceTo(this.controls.target);
    const pixel = metresOfPixel(distance, (camera.fov * Math.PI) / 180, renderer.domElement.height);
    const least = VISIBLE * pixel;
    return (
      farthest(drawn.arm, this.outline(shown.posture)) > least ||
      farthest(drawn.ghost, this.outline(shown.ghost)) > least
    );
  }

  private outline(posture: readonly number[] | null | undefined): Vector[] | null {
    return posture ? outlineOf(this.chain, posture, HAND * this.reach) : null;
  }

  /** Draws with the next frame, or when the budget allows it. */
  private invalidate(): void {
    if (this.frame !== 0 || this.timer !== null) return;
    const wait = this.budget?.wait(seconds()) ?? 0;
    if (wait === 0) {
      this.frame = requestAnimationFrame(() => this.draw());
      return;
    }
    this.isAwaited = wait === Infinity;
    if (this.isAwaited) return;
    this.timer = setTimeout(() => {
      this.timer = null;
      this.frame ||= requestAnimationFrame(() => this.draw());
    }, 1000 * wait);
  }

  private draw(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    const begin = seconds();
    this.pose();
    this.renderer.render(this.scene, this.camera);
    if (this.budget) {
      this.budget.begun();
      this.whenDone((end) => {
        this.budget?.spent(begin, end - begin);
        if (this.isAwaited) this.invalidate();
      });
    }
    this.drawn = { arm: this.outline(this.shown.posture), ghost: this.outline(this.shown.ghost) };
  }

  /** Puts arm, ghost and trail where they are now: not for every sample, but for every picture. */
  private pose(): void {
    const { posture, ghost } = this.shown;
    if (posture) for (const figure of [this.arm, this.shadow]) figure.take(posture);
    if (ghost) this.ghost.take(ghost);
    this.trail.paint();
  }

  /** Calls when the picture is drawn, which is later than it was asked for: what it costs is not known before. */
  private whenDone(call: (at: number) => void): void {
    const begin = seconds();
    const context = this.renderer.getContext() as WebGL2RenderingContext;
    const fence = context.fenceSync(context.SYNC_GPU_COMMANDS_COMPLETE, 0);
    context.flush();
    const look = (): void => {
      const isDone =
        fence === null || context.getSyncParameter(fence, context.SYNC_STATUS) === context.SIGNALED;
      const isGivenUp = this.isDisposed || seconds() > begin + GIVE_UP;
      if (!isDone && !isGivenUp) {
        setTimeout(look, LOOK_EVERY);
        return;
      }
      context.deleteSync(fence);
      call(seconds());
    };
    setTimeout(look, LOOK_EVERY);
  }
}

function seconds(): number {
  return performance.now() / 1000;
}

function all(chain: Chain, material: MeshBasicMaterial | MeshLambertMaterial): FigureMaterials {
  return { links: chain.map(() => material), body: material };
}

function disposed(grid: GridHelper): GridHelper {
  grid.geometry.dispose();
  (grid.material as LineBasicMaterial).dispose();
  return grid;
}
