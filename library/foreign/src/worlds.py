"""The other end of the pipe of `gymnasium(..)`: worlds in lanes, stepped by frames over standard input and output.

    python -c SCRIPT NAME KWARGS

First it says what the world is, in a line of JSON, or why there is none. Then it reads how many lanes there are (u32),
and for each frame answers one, all in the byte order of the machine:

    asked     for each lane a byte: 0 for nothing; 1 for a step or 2 for a reset, one of which a frame is
              of these lanes in order: their seeds (u32), or their actions (i32, or f32 of so many)
    answered  the number of the frame (u32), from 1
              each field (f32, u8 or u32) of these lanes in order
              their rewards (f64)
              their ends (u8): 0 none, 1 terminal, 2 cut off
"""
import json
import os
import platform
import sys

OUT = os.fdopen(os.dup(1), "wb", buffering=1 << 20)
os.dup2(2, 1)  # What a world prints is no frame.
sys.path = [path for path in sys.path if path]


def say(what):
    OUT.write(json.dumps(what, sort_keys=True, allow_nan=False).encode() + b"\n")
    OUT.flush()


def refuse(why):
    say({"refused": str(why)})
    sys.exit(0)


try:
    import gymnasium
    import numpy as np
except ImportError as error:
    refuse(f"cannot import gymnasium ({error}): `pip install gymnasium`")

spaces = gymnasium.spaces


def seen(space, name):
    """The fields of what is seen: name, shape, kind, how many there are to choose from, the first, and the way to it."""
    if isinstance(space, spaces.Box):
        kind = "u8" if space.dtype == np.uint8 else "f32"
        return [(name or "observation", list(space.shape), kind, 0, 0, ())]
    if isinstance(space, spaces.Discrete):
        return [(name or "observation", [], "index", int(space.n), int(space.start), ())]
    if isinstance(space, spaces.MultiBinary):
        return [(name or "observation", list(space.shape), "bit", 0, 0, ())]
    if isinstance(space, spaces.Dict):
        parts = list(space.items())
    elif isinstance(space, spaces.Tuple):
        parts = list(enumerate(space))
    else:
        refuse(f"what is seen of it is {space}; understood are Box, Discrete, MultiBinary, and Dict and Tuple of these")
    fields = []
    for key, part in parts:
        inner = seen(part, f"{name}.{key}" if name else str(key))
        fields += [(*field[:5], (key, *field[5])) for field in inner]
    return fields


def done(space):
    """What can be done."""
    if isinstance(space, spaces.Discrete):
        return {"discrete": int(space.n)}
    if isinstance(space, spaces.Box) and np.issubdtype(space.dtype, np.floating):
        if not space.is_bounded():
            refuse(f"its actions have no bounds: {space}")
        return {"low": space.low.ravel().tolist(), "high": space.high.ravel().tolist()}
    refuse(f"its actions are {space}; understood are Discrete, and Box of real numbers with bounds")


def provider(entry):
    """Who made it: where it is in Python, and the distribution that has it with its version."""
    from importlib import metadata

    where = entry if isinstance(entry, str) else f"{entry.__module__}:{entry.__qualname__}"
    top = where.split(".")[0].split(":")[0]
    try:
        return where, f"{top} {metadata.version(top)}"
    except metadata.PackageNotFoundError:
        names = metadata.packages_distributions().get(top, [])
        return where, ", ".join(sorted(f"{name} {metadata.version(name)}" for name in set(names)))


def make():
    # Frames are looked at where they are read, so that nothing needs to look at each step here too.
    return gymnasium.make(NAME, disable_env_checker=True, **KWARGS)


NAME, KWARGS = sys.argv[1], json.loads(sys.argv[2])
try:
    first = make()
except Exception as error:
    refuse(error)
FIELDS, ACTION = seen(first.observation_space, ""), first.action_space
entry_point, distribution = provider(first.spec.entry_point)
say(
    {
        "actions": done(ACTION),
        "distribution": distribution,
        "entry_point": entry_point,
        "gymnasium": gymnasium.__version__,
        "kwargs": KWARGS,
        "limit": first.spec.max_episode_steps,
        "name": NAME,
        "numpy": np.__version__,
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "sees": [{"name": f[0], "shape": f[1], "kind": f[2], "n": f[3]} for f in FIELDS],
    }
)


def writer(field, rows):
    """Writes what is seen of a field into a row."""
    _, shape, kind, n, start, path = field
    shape = tuple(shape)

    def index(row, value):
        value = int(value) - start
        if not 0 <= value < n:
            raise ValueError(f"{value + start} was seen, which is none of the {n} from {start}")
        rows[row] = value

    def numbers(row, value):
        value = np.asarray(value)
        if value.shape != shape:
            raise ValueError(f"an observation of shape {value.shape} was seen instead of {shape}")
        rows[row] = value

    put = index if kind == "index" else numbers

    def inside(row, value):
        for key in path:
            value = value[key]
        put(row, value)

    return inside if path else put


def serve(inp, worlds):
    n, number, dtypes = len(worlds), 0, {"f32": np.float32, "u8": np.uint8, "bit": np.uint8, "index": np.uint32}
    columns = [np.zeros((n, *field[1]), dtypes[field[2]]) for field in FIELDS]
    puts = [writer(field, rows) for field, rows in zip(FIELDS, columns)]

    def all_of(row, observation):
        for put in puts:
            put(row, observation)

    put = puts[0] if len(puts) == 1 else all_of
    rewards, ends = np.zeros(n, np.float64), bytearray(n)
    discrete = isinstance(ACTION, spaces.Discrete)
    width = 1 if discrete else int(np.prod(ACTION.shape))
    steps, resets = [world.step for world in worlds], [world.reset for world in worlds]
    parts = [(memoryview(rows).cast("B"), rows.nbytes // n) for rows in (*columns, rewards)]
    while asked := inp.read(n):
        number, k, is_step = number + 1, n - asked.count(0), 1 in asked
        lanes = range(n) if k == n else [lane for lane, what in enumerate(asked) if what]
        given = inp.read(4 * k * (width if is_step else 1))
        if is_step:
            if discrete:
                acts = (np.frombuffer(given, np.int32) + ACTION.start).tolist()
            else:
                acts = np.frombuffer(given, np.float32).astype(ACTION.dtype).reshape(k, *ACTION.shape)
            for row, (lane, act) in enumerate(zip(lanes, acts)):
                observation, reward, terminal, cut, _ = steps[lane](act)
                put(row, observation)
                rewards[row] = reward
                ends[row] = 1 if terminal else 2 if cut else 0
        else:
            rewards[:], ends[:] = 0, bytes(n)
            for row, (lane, seed) in enumerate(zip(lanes, np.frombuffer(given, np.uint32).tolist())):
                put(row, resets[lane](seed=seed)[0])
        OUT.write((number & 0xFFFFFFFF).to_bytes(4, sys.byteorder))
        for rows, size in parts:
            OUT.write(rows[: k * size])
        OUT.write(memoryview(ends)[:k])
        OUT.flush()


INP = os.fdopen(0, "rb", buffering=1 << 20)
if head := INP.read(4):
    serve(INP, [first] + [make() for _ in range(int(np.frombuffer(head, np.uint32)[0]) - 1)])
