"""A solar panel in the shadow of its satellite. Look at: the shares by degree of the orbit, and the night beside its closed form."""

import numpy as np

import glshadow as gs

EARTH, HEIGHT, BETA = 6371e3, 500e3, 60.0  # metres; degrees between the sun and the plane of the orbit
Corner = tuple[float, float, float]


def box(low: Corner, high: Corner, color: tuple[float, float, float, float]) -> gs.Mesh:
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    faces = np.array([*map(int, "023031457476015054267273046062137175")], dtype=np.int32).reshape(-1, 3)
    return gs.Mesh(corners, faces, material=gs.Material(color))


# y is away from the earth, z is the axis of the orbit
body_box = box((-0.5, -0.8, -0.5), (0.5, 0.8, 0.5), (0.8, 0.7, 0.4, 1.0))
panel_box = box((-0.6, -0.02, 0.7), (0.6, 0.02, 3.1), (0.1, 0.15, 0.45, 1.0))
satellite = gs.Scene([gs.Node(body_box, name="body"), gs.Node(panel_box, name="panel")])
# the earth, as a disc across the line to its middle where lines from the satellite touch it
dip = np.arcsin(EARTH / (EARTH + HEIGHT))
turn = 2 * np.pi * np.arange(720) / 720
rim = np.stack([np.tan(dip) * np.cos(turn), np.full(720, -1.0), np.tan(dip) * np.sin(turn)], axis=1) * 1e3
k = np.arange(720)
earth = gs.Mesh(np.vstack([rim, [[0, -1e3, 0]]]), np.stack([k, np.roll(k, -1), np.full(720, 720)], axis=1))
planet = gs.Scene([gs.Node(earth, name="earth")])

x, z = np.meshgrid((np.arange(24) + 0.5) / 24 * 1.2 - 0.6, (np.arange(48) + 0.5) / 48 * 2.4 + 0.7)
points = np.stack([x.ravel(), np.full(x.size, 0.02), z.ravel()], axis=1)
body, panel = (satellite.places[name] for name in ("body", "panel"))
shares = []
for degrees in range(360):  # from noon
    a, b = np.radians(degrees), np.radians(BETA)
    to_sun = np.array([np.sin(a) * np.cos(b), np.cos(a) * np.cos(b), -np.sin(b)])
    sun = gs.DirectionalLight(direction=tuple(-to_sun))
    night = gs.blockers(planet, points, sun).node[0] == 0
    first = gs.blockers(satellite, points, sun).node[0]
    shares.append([np.mean(night), *(np.mean((first == i) & ~night) for i in (panel, body, -1))])
print("degrees  by the earth  by itself  by the body   lit")
for degrees in (0, 45, 75, 89, 120, 160, 180):
    night, away, shadow, lit = shares[degrees]
    print(f"{degrees:7d}{night:14.3f}{away:11.3f}{shadow:13.3f}{lit:6.3f}")
print(f"night: {np.mean(np.array(shares)[:, 0]):.3f} of the orbit", end=", ")
print(f"closed form {np.arccos(np.cos(dip) / np.cos(np.radians(BETA))) / np.pi:.3f}")

a, b = np.radians(20.0), np.radians(BETA)
sun = gs.DirectionalLight(direction=(-np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b), np.sin(b)))
camera = gs.PerspectiveCamera((3.4, 3.0, 4.0), (0.0, 0.0, 1.2), fov_y=38)
gs.render(satellite, camera, sun, (960, 540), path="43_solar_panel.png", background=(0, 0, 0))
