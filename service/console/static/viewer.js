// Clouds, boxes and cameras in 3-D, to turn and zoom: every <figure class="viewer" data-scene="URL">, also those that htmx brings later.
//
// The URL answers {"clouds": [{"name", "points": [x, y, z, …], "colour", "colours": [r, g, b, …] or none}], "boxes": [{"name", "corners":
// 8 × [x, y, z] in the order of core.boxes, "colour"}], "cameras": [{"world_from_camera", "K", "size": [height, width]}], "up": [x, y, z]}:
// metres, camera axes as OpenCV's, colours named by the custom properties --cloud-NAME, or 0 to 255 for each point. Clouds with different
// "choice" are shown in each other's place.

import * as THREE from "./vendor/three.module.min.js";
import { OrbitControls } from "./vendor/OrbitControls.js";

const EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((a) => [0, 1, 2].filter((axis) => !(a & (1 << axis))).map((axis) => [a, a | (1 << axis)]));
const FIELD_OF_VIEW_DEG = 35;
const MARGIN = 0.92; // a bounding sphere is larger than what is in it
const FRUSTUM_DEPTH = 0.22; // of the distance from the camera to what it looks at
const TURN = Math.PI / 18;
const ZOOM = 1.15;
const open = new Map();

/** What a custom property that holds light-dark() comes to, in the theme that is on. */
function resolved(figure, property) {
  const probe = document.createElement("span");
  probe.style.color = `var(${property}, currentColor)`;
  figure.append(probe);
  const colour = new THREE.Color(getComputedStyle(probe).color);
  probe.remove();
  return colour;
}

function disc() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const context = canvas.getContext("2d");
  context.fillStyle = "#fff";
  context.arc(32, 32, 31, 0, 2 * Math.PI);
  context.fill();
  return new THREE.CanvasTexture(canvas);
}

function pointsOf(cloud, radius, map) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(cloud.points, 3));
  if (cloud.colours) {
    const linear = new Float32Array(cloud.colours.length);
    const colour = new THREE.Color();
    for (let i = 0; i < linear.length; i += 3) {
      colour.setRGB(cloud.colours[i] / 255, cloud.colours[i + 1] / 255, cloud.colours[i + 2] / 255, THREE.SRGBColorSpace);
      colour.toArray(linear, i);
    }
    geometry.setAttribute("color", new THREE.BufferAttribute(linear, 3));
  }
  const count = cloud.points.length / 3;
  const size = Math.min(0.06, 4 / Math.sqrt(count || 1)) * radius;
  const material = new THREE.PointsMaterial({ size, map, alphaTest: 0.5, vertexColors: Boolean(cloud.colours) });
  const points = new THREE.Points(geometry, material);
  points.userData.choice = cloud.choice;
  points.userData.property = cloud.colours ? null : `--cloud-${cloud.colour}`;
  return points;
}

function lines(pairs, property) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(pairs.flat(2), 3));
  const drawn = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial());
  drawn.userData.property = property;
  return drawn;
}

function frustum(camera, middle) {
  const rows = camera.world_from_camera;
  const matrix = new THREE.Matrix4().set(...rows.flat());
  const centre = new THREE.Vector3().setFromMatrixPosition(matrix);
  const depth = FRUSTUM_DEPTH * centre.distanceTo(middle);
  const [[fx, , cx], [, fy, cy]] = camera.K;
  const [height, width] = camera.size;
  const corners = [[0, 0], [width, 0], [width, height], [0, height]].map(([u, v]) =>
    new THREE.Vector3(((u - cx) / fx) * depth, ((v - cy) / fy) * depth, depth).applyMatrix4(matrix).toArray());
  const top = new THREE.Vector3((width / 2 - cx) / fx * depth, (-0.35 * height - cy) / fy * depth, depth).applyMatrix4(matrix).toArray();
  const pairs = corners.flatMap((corner, i) => [[centre.toArray(), corner], [corner, corners[(i + 1) % 4]]]);
  return [...pairs, [corners[0], top], [top, corners[1]]];
}

class Viewer {
  constructor(figure, scene) {
    this.figure = figure;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.canvas = this.renderer.domElement;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.001, 1000);
    this.camera.up.set(...(scene.up ?? [0, 0, 1]));
    this.draw = this.draw.bind(this);
    this.fill(scene);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", this.draw);
    this.furnish(scene);
    this.recolour();
    this.resizing = new ResizeObserver(() => this.resize());
    this.resizing.observe(figure);
    this.resize();
    this.fit(this.things);
  }

  fill(scene) {
    const sphere = new THREE.Box3();
    for (const { points } of scene.clouds) {
      for (let i = 0; i < points.length; i += 3) sphere.expandByPoint(new THREE.Vector3(points[i], points[i + 1], points[i + 2]));
    }
    for (const box of scene.boxes) for (const corner of box.corners) sphere.expandByPoint(new THREE.Vector3(...corner));
    this.things = sphere.getBoundingSphere(new THREE.Sphere());
    const map = disc();
    this.groups = { points: new THREE.Group(), boxes: new THREE.Group(), cameras: new THREE.Group() };
    for (const cloud of scene.clouds) this.groups.points.add(pointsOf(cloud, this.things.radius, map));
    for (const box of scene.boxes) this.groups.boxes.add(lines(EDGES.map(([a, b]) => [box.corners[a], box.corners[b]]), `--cloud-${box.colour}`));
    const frusta = scene.cameras.flatMap((camera) => frustum(camera, this.things.center));
    if (frusta.length) this.groups.cameras.add(lines(frusta, "--cloud-camera"));
    this.scene.add(...Object.values(this.groups));
    const all = new THREE.Box3().copy(sphere);
    for (const { world_from_camera: rows } of scene.cameras) all.expandByPoint(new THREE.Vector3(rows[0][3], rows[1][3], rows[2][3]));
    this.everything = all.getBoundingSphere(new THREE.Sphere());
    this.from = this.startDirection(scene);
  }

  /** Looks from where the first camera did, a little from above. */
  startDirection(scene) {
    const up = this.camera.up.clone().normalize();
    const first = scene.cameras[0]?.world_from_camera;
    const seen = first ? new THREE.Vector3(first[0][3], first[1][3], first[2][3]).sub(this.things.center) : new THREE.Vector3(1, -1.4, 0.8);
    const level = seen.clone().addScaledVector(up, -seen.dot(up));
    if (level.lengthSq() < 1e-9) level.set(up.y, up.z, up.x).addScaledVector(up, -up.dot(new THREE.Vector3(up.y, up.z, up.x)));
    return level.normalize().applyAxisAngle(up, 0.5).addScaledVector(up, 0.45).normalize();
  }

  furnish(scene) {
    const names = [...scene.clouds, ...scene.boxes].map((each) => each.name).filter(Boolean);
    const count = scene.clouds.reduce((sum, cloud) => sum + cloud.points.length / 3, 0);
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `3-D view of ${[...new Set(names)].join(", ")}: ${count} points, ${scene.cameras.length} cameras. Arrow keys turn it, plus and minus zoom.`);
    this.canvas.addEventListener("keydown", (event) => this.onKey(event));
    this.figure.prepend(this.canvas);
    const tools = document.createElement("div");
    tools.className = "viewer-tools";
    const parts = [["boxes", "Box"], ["cameras", "Cameras"]].filter(([name]) => this.groups[name].children.length);
    const choices = [...new Set(scene.clouds.map((cloud) => cloud.choice).filter(Boolean))];
    if (choices.length > 1) tools.append(...this.alternatives(choices));
    for (const [name, title] of parts) tools.append(this.toggle(title, this.groups[name], name));
    this.figure.append(tools);
  }

  /** One button a choice, of which one is pressed. */
  alternatives(choices) {
    const buttons = choices.map((choice) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = choice;
      button.addEventListener("click", () => choose(choice));
      return button;
    });
    const choose = (chosen) => {
      for (const points of this.groups.points.children) points.visible = !points.userData.choice || points.userData.choice === chosen;
      buttons.forEach((button, i) => button.setAttribute("aria-pressed", String(choices[i] === chosen)));
      this.draw();
    };
    choose(choices[0]);
    return buttons;
  }

  toggle(title, group, name) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = title;
    const show = (on) => {
      group.visible = on;
      button.setAttribute("aria-pressed", String(on));
      if (name === "cameras" && this.controls) this.fit(on ? this.everything : this.things);
      this.draw();
    };
    button.addEventListener("click", () => show(!group.visible));
    show(name !== "cameras");
    return button;
  }

  onKey(event) {
    const turns = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, -TURN], ArrowDown: [0, TURN] };
    const zooms = { "+": 1 / ZOOM, "=": 1 / ZOOM, "-": ZOOM };
    if (!(event.key in turns) && !(event.key in zooms)) return;
    event.preventDefault();
    const away = this.camera.position.clone().sub(this.controls.target);
    const toY = new THREE.Quaternion().setFromUnitVectors(this.camera.up, new THREE.Vector3(0, 1, 0));
    const spherical = new THREE.Spherical().setFromVector3(away.applyQuaternion(toY));
    const [left, down] = turns[event.key] ?? [0, 0];
    spherical.theta += left;
    spherical.phi += down;
    spherical.radius *= zooms[event.key] ?? 1;
    away.setFromSpherical(spherical.makeSafe()).applyQuaternion(toY.invert());
    this.camera.position.copy(this.controls.target).add(away);
    this.controls.update();
  }

  /** Shows a sphere whole. */
  fit(sphere) {
    const half = THREE.MathUtils.degToRad(FIELD_OF_VIEW_DEG / 2);
    const narrow = Math.atan(Math.tan(half) * Math.min(1, this.camera.aspect));
    const distance = (MARGIN * Math.max(sphere.radius, 1e-3)) / Math.sin(narrow);
    const away = this.camera.position.lengthSq() ? this.camera.position.clone().sub(this.controls.target).normalize() : this.from;
    this.camera.position.copy(sphere.center).addScaledVector(away, distance);
    this.camera.near = distance / 100;
    this.camera.far = distance * 20;
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(sphere.center);
    this.controls.update();
    this.draw();
  }

  recolour() {
    this.scene.traverse((each) => {
      if (each.userData.property) each.material.color.copy(resolved(this.figure, each.userData.property));
    });
    this.draw();
  }

  resize() {
    const { clientWidth, clientHeight } = this.figure;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    if (!this.waiting) this.waiting = requestAnimationFrame(() => { this.waiting = 0; this.renderer.render(this.scene, this.camera); });
  }

  close() {
    cancelAnimationFrame(this.waiting);
    this.resizing.disconnect();
    this.controls.dispose();
    this.scene.traverse((each) => { each.geometry?.dispose(); each.material?.dispose(); });
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }
}

function say(figure, text) {
  const note = document.createElement("p");
  note.className = "viewer-note";
  note.textContent = text;
  figure.append(note);
}

async function start(figure) {
  if (open.has(figure)) return;
  open.set(figure, null);
  try {
    const answer = await fetch(figure.dataset.scene);
    if (!answer.ok) throw new Error((await answer.json().catch(() => ({}))).detail ?? `the service answered ${answer.status}`);
    const viewer = new Viewer(figure, await answer.json());
    open.set(figure, viewer);
    figure.dataset.ready = "";
  } catch (error) {
    say(figure, `No 3-D view: ${error.message}`);
  }
}

const seen = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    if (!entry.isIntersecting) continue;
    seen.unobserve(entry.target);
    start(entry.target);
  }
}, { rootMargin: "200px" });

function look(within) {
  for (const figure of within.querySelectorAll("figure.viewer[data-scene]")) if (!open.has(figure)) seen.observe(figure);
}

function recolourAll() {
  for (const viewer of open.values()) viewer?.recolour();
}

look(document);
document.addEventListener("htmx:load", (event) => look(event.detail.elt.parentElement ?? document));
document.addEventListener("htmx:beforeCleanupElement", (event) => {
  const viewer = open.get(event.detail.elt);
  viewer?.close();
  open.delete(event.detail.elt);
});
document.documentElement.addEventListener("themechange", recolourAll);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolourAll);
