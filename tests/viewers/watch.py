"""A viewer of the Foxglove WebSocket protocol, written from its specification, independent of the server's library.

    watch.py live PERCUSS          watches a live run, with slow viewers and viewers that come and go
    watch.py replay PERCUSS_READ   watches replays, and plays, pauses and seeks

Needs the PyPI packages websockets, mcap and mcap-protobuf-support. Every message received is compared with the file.
"""

import asyncio
import base64
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

import websockets
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

MESSAGE, TIME, PLAYBACK = 1, 2, 5
PLAYING, PAUSED, BUFFERING, ENDED = 0, 1, 2, 3
END = re.compile(rb"completed")


class Viewer:
    """One connection: subscribes and keeps what comes, in order.

    `shown` is what Lichtblick would show: messages at the time that was sent last, nothing of before when time goes back.
    """

    def __init__(self, url, subprotocols=("foxglove.sdk.v1",)):
        self.url = url
        self.subprotocols = subprotocols
        self.channels = {}
        self.messages = {}
        self.shown = {}
        self.jumps = 0
        self.states = []
        self.times = []
        self.info = None

    async def connect(self, **options):
        # the library stops reading, and cannot close, once so many frames wait: no limit unless a slow viewer is wanted
        options = {"max_queue": None, **options}
        self.socket = await websockets.connect(
            self.url, subprotocols=self.subprotocols, max_size=None, proxy=None, **options
        )
        return self

    async def subscribe(self, *topics):
        """Waits for the advertisement and subscribes to these topics, or to all of them."""
        while not self.channels:
            self.take(await self.socket.recv())
        ids = [id for id, channel in self.channels.items() if not topics or channel["topic"] in topics]
        wanted = [{"id": 1000 + id, "channelId": id} for id in ids]
        await self.socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        return self

    def take(self, frame):
        if isinstance(frame, str):
            content = json.loads(frame)
            if content["op"] == "serverInfo":
                self.info = content
            elif content["op"] == "advertise":
                self.channels.update({channel["id"]: channel for channel in content["channels"]})
                self.messages.update({channel["topic"]: [] for channel in content["channels"]})
        elif frame[0] == MESSAGE:
            subscription, log_time = struct.unpack_from("<IQ", frame, 1)
            topic = self.channels[subscription - 1000]["topic"]
            self.messages[topic].append((log_time, bytes(frame[13:])))
            assert log_time == self.times[-1], f"{topic}: a message of {log_time} at {self.times[-1]}"
            self.shown.setdefault(topic, []).append(log_time)
        elif frame[0] == TIME:
            time = struct.unpack_from("<Q", frame, 1)[0]
            if self.times and time < self.times[-1]:
                self.shown.clear()
                self.jumps += 1
            self.times.append(time)
        elif frame[0] == PLAYBACK:
            self.states.append(struct.unpack_from("<BQfB", frame, 1))
        else:
            raise AssertionError(f"unknown opcode {frame[0]}")

    async def watch(self, until=lambda viewer: False, patience=30):
        """Receives until a condition holds or the server closes."""
        try:
            async with asyncio.timeout(patience):
                while not until(self):
                    self.take(await self.socket.recv())
        except websockets.ConnectionClosed:
            pass

    async def watch_for(self, seconds):
        """Receives for a while."""
        try:
            await self.watch(patience=seconds)
        except TimeoutError:
            pass

    async def play(self, play=True, speed=1.0, seek=None, request=b"r"):
        seconds = 0 if seek is None else seek
        await self.socket.send(
            struct.pack("<BBfBQI", 3, 0 if play else 1, speed, seek is not None, seconds, len(request)) + request
        )


def decoders(viewer):
    """A message class for every topic, from the schemas that were advertised."""
    classes = {}
    for channel in viewer.channels.values():
        assert channel["encoding"] == "protobuf" and channel["schemaEncoding"] == "protobuf", channel
        pool = descriptor_pool.DescriptorPool()
        files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
        for file in files.file:
            pool.Add(file)
        descriptor = pool.FindMessageTypeByName(channel["schemaName"])
        classes[channel["topic"]] = message_factory.GetMessageClass(descriptor)
    return classes


def recorded(path):
    """Messages of a file by topic."""
    messages = {}
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            messages.setdefault(channel.topic, []).append((message.log_time, message.data))
    return messages


def compare(viewer, path, whole=True):
    """Everything that came is in the file, in order, and decodes; all of it did if `whole`."""
    file, classes, count = recorded(path), decoders(viewer), 0
    assert set(file) <= set(viewer.messages), set(file) - set(viewer.messages)
    for topic, messages in viewer.messages.items():
        rest = iter(file.get(topic, []))
        for message in messages:
            assert message in rest, f"{topic}: {message[0]} is not in the file, or not in this order"
            classes[topic].FromString(message[1])
        count += len(messages)
        if whole:
            assert len(messages) == len(file.get(topic, [])), (topic, len(messages), len(file.get(topic, [])))
    return count


def start(*command):
    """Starts a server and returns it with its address."""
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    said = b""
    while True:
        line = process.stderr.readline()
        said += line
        found = re.search(rb"ws://[\d.]+:\d+", line)
        if found:
            return process, found[0].decode()
        assert line, f"{command} says no address: {said.decode()}"


def without_host(path):
    """Bytes of a recording but for percuss.host and what depends on it."""
    with open(path, "rb") as file:
        data = bytearray(file.read())
    at = data.find(b"percuss.host")
    data[at - 12 : at + 1100] = b""
    # checksum over the data section, just before the summary
    with open(path, "rb") as file:
        summary = make_reader(file).get_summary()
    assert summary.statistics is not None
    end = struct.unpack_from("<Q", data, len(data) - 28)[0] - 1112
    data[end - 4 : end] = b""
    return bytes(data)


async def live(percuss, folder):
    case = ["run", "fig5", "--set", "mesh.cells=50", "--set", "run.end_time=3", "--threads", "2"]
    alone = folder / "alone.mcap"
    subprocess.run([percuss, *case, "-o", alone], check=True, stderr=subprocess.DEVNULL)

    # one viewer that keeps up, as fast as it computes
    watched = folder / "watched.mcap"
    process, url = start(percuss, *case, "-o", watched, "--live", "0", "--wait", "--hold", "0")
    viewer = await (await Viewer(url).connect()).subscribe()
    await viewer.watch()
    assert process.wait() == 0
    count = compare(viewer, watched, whole=False)
    file = recorded(watched)
    assert all(viewer.messages[topic] for topic in file), "something of every channel"
    for topic in ["/drag", "/velocity", "/probes", "/event", "/log", "/view/tf"]:
        assert viewer.shown.get(topic, []) == [log_time for log_time, _ in file.get(topic, [])], topic
    channels = len(viewer.channels)
    print(f"live, as fast as it computes: {count} messages of {channels} channels, in order, at their times")

    # panel by panel, and when all is over; the end is held until they leave
    panels = folder / "panels.mcap"
    process, url = start(percuss, *case, "-o", panels, "--live", "0", "--pace", "0.75")
    viewer = await Viewer(url).connect()
    for topic, pause in [("/drag", 0.5), ("/log", 0.5), ("/velocity", 0.4)]:
        await viewer.watch_for(pause)
        await viewer.subscribe(topic)
    await viewer.watch(until=lambda viewer: any(END.search(data) for _, data in viewer.messages["/log"]))
    late = await (await Viewer(url).connect()).subscribe()
    await late.watch(until=lambda viewer: any(END.search(data) for _, data in viewer.messages["/log"]))
    await viewer.watch_for(0.3)
    await late.watch_for(0.3)
    assert process.poll() is None
    await viewer.socket.close()
    await late.socket.close()
    assert process.wait(timeout=5) == 0
    file = recorded(panels)
    for one, topics in [(viewer, ["/drag", "/log", "/velocity"]), (late, ["/drag", "/log", "/velocity", "/probes"])]:
        for topic in topics:
            assert one.shown[topic] == [log_time for log_time, _ in file[topic]], topic
    assert (viewer.jumps, late.jumps) == (2, 0), (viewer.jumps, late.jumps)
    assert late.shown["/field/stress"] == [file["/field/stress"][-1][0]], "of pictures the last"
    print("live: who comes late or panel by panel gets the beginning, too")

    # three slow viewers, twenty that come and go, one that keeps up: paced
    crowd = folder / "crowd.mcap"
    crowded = ["--wait", "4", "--pace", "0.5", "--hold", "0"]
    process, url = start(percuss, *case, "-o", crowd, "--live", "0", *crowded)
    slow = [await (await Viewer(url).connect(max_queue=1)).subscribe() for _ in range(3)]
    viewer = await (await Viewer(url).connect()).subscribe()

    async def come_and_go():
        for number in range(20):
            guest = await (await Viewer(url).connect()).subscribe()
            if number % 2:
                await guest.watch(until=lambda guest: sum(map(len, guest.messages.values())) > 5)
                await guest.socket.close()
            else:
                guest.socket.transport.abort()
            await asyncio.sleep(0.05)

    await asyncio.gather(viewer.watch(), come_and_go())
    for one in slow:
        one.socket.transport.abort()
    assert process.wait() == 0
    count = compare(viewer, crowd)
    assert viewer.times == sorted(viewer.times) and len(viewer.times) > 50, len(viewer.times)
    print(f"live, paced, among 3 slow viewers and 20 that come and go: all {count} messages, in order")
    for path in [watched, panels, crowd]:
        assert without_host(path) == without_host(alone), f"{path} differs from the run without a viewer"
    print(f"recordings: {alone.stat().st_size} bytes, the same with and without viewers")

    # bad addresses
    process, url = start(percuss, *case, "-o", folder / "first.mcap", "--live", "0", "--wait")
    taken = subprocess.run([percuss, *case, "-o", folder / "b.mcap", "--live", url[5:]], capture_output=True)
    assert taken.returncode == 1 and url[5:].encode() in taken.stderr, taken
    assert not (folder / "b.mcap").exists()
    process.terminate()
    assert process.wait() == 143
    bad = subprocess.run([percuss, *case, "--live", "a:b"], capture_output=True)
    assert bad.returncode == 2 and b"HOST:PORT" in bad.stderr


async def replay(reader, folder):
    percuss = str(pathlib.Path(reader).with_name("percuss"))
    run = folder / "run.mcap"
    case = ["run", "fig5", "--set", "mesh.cells=50", "--set", "run.end_time=3"]
    subprocess.run([percuss, *case, "-o", run], check=True, stderr=subprocess.DEVNULL)

    # once, four times as fast: everything, in order, and not faster than that
    process, url = start(reader, "replay", run, "--addr", "0", "--speed", "4", "--once")
    clock = asyncio.get_running_loop().time
    viewer = await (await Viewer(url).connect()).subscribe()
    await viewer.watch(until=lambda viewer: viewer.times)
    begin = clock()
    await viewer.watch(until=lambda viewer: any(END.search(data) for _, data in viewer.messages["/log"]))
    took = clock() - begin
    await viewer.watch_for(0.3)
    await viewer.socket.close()
    assert process.wait(timeout=5) == 0
    count = compare(viewer, run)
    assert 0.6 < took < 3, took
    print(f"replay: all {count} messages of {len(viewer.channels)} channels, in order, in {took:.2f} s")

    # a window, as fast as it goes
    window = ["--from", "1", "--to", "2", "--speed", "1000", "--once", "--hold", "0"]
    process, url = start(reader, "replay", run, "--addr", "0", *window)
    viewer = await (await Viewer(url).connect()).subscribe()
    await viewer.watch()
    assert process.wait() == 0
    compare(viewer, run, whole=False)
    times = [log_time for log_time, _ in viewer.messages["/drag"]]
    assert min(times) >= 10**9 and max(times) == 2 * 10**9, (min(times), max(times))

    # playback control
    process, url = start(reader, "replay", run, "--addr", "0")
    viewer = await (await Viewer(url).connect()).subscribe()
    assert "playbackControl" in viewer.info["capabilities"], viewer.info
    assert viewer.info["dataEndTime"] == {"sec": 3, "nsec": 0}, viewer.info
    await viewer.watch(until=lambda viewer: len(viewer.messages["/drag"]) > 20)
    await viewer.play(play=False)
    await viewer.watch(until=lambda viewer: any(state[0] == PAUSED for state in viewer.states))
    await asyncio.sleep(0.3)
    await viewer.watch_for(0.3)
    seen = len(viewer.messages["/drag"])
    await viewer.watch_for(0.5)
    assert len(viewer.messages["/drag"]) == seen, "it stands still"
    # to a time: the last messages before it come at once, so that the picture is whole
    await viewer.play(play=False, seek=2_500_000_000)
    await viewer.watch(until=lambda viewer: any(state[3] for state in viewer.states))
    await viewer.watch_for(0.5)
    for topic in ["/drag", "/field/stress", "/view/scene", "/view/tf"]:
        log_time = viewer.messages[topic][-1][0]
        assert 2_400_000_000 < log_time <= 2_500_000_000, (topic, log_time)
    await viewer.play(speed=5.0)
    await viewer.watch(until=lambda viewer: any(state[0] == ENDED for state in viewer.states))
    assert viewer.states[-1][2] == 5.0, viewer.states
    # messages and states come in one order
    assert viewer.messages["/drag"][-1][0] == 3_000_000_000, viewer.messages["/drag"][-1][0]
    # back, and play on from there
    await viewer.play(speed=5.0, seek=1_000_000_000)
    await viewer.watch(until=lambda viewer: viewer.messages["/drag"][-1][0] < 1_500_000_000)
    await viewer.watch(until=lambda viewer: viewer.messages["/drag"][-1][0] > 2_000_000_000)
    # Lichtblick 1.28 offers both protocols and knows the older one, which has no playback control
    older = Viewer(url, ["foxglove.websocket.v1", "foxglove.sdk.v1"])
    older = await (await older.connect()).subscribe()
    await older.watch(until=lambda older: older.messages["/drag"])
    assert older.info["capabilities"] == ["time"] and not older.states, older.info
    process.terminate()
    assert process.wait() == -15
    print("replay: plays, pauses, goes to times forward and back, at any speed; no states to viewers that do not know them")

    # round and round
    process, url = start(reader, "replay", run, "--addr", "0", "--speed", "20", "--loop")
    viewer = await (await Viewer(url).connect()).subscribe()
    first = lambda viewer: sum(log_time == 0 for log_time, _ in viewer.messages["/drag"])
    await viewer.watch(until=lambda viewer: first(viewer) >= 3)
    process.terminate()
    process.wait()
    print("replay: goes round and round")

    # a file that is cut off: what is sound of it
    cut = folder / "cut.mcap"
    cut.write_bytes(run.read_bytes()[:-2000])
    process, url = start(reader, "replay", cut, "--addr", "0", "--speed", "1000", "--once", "--hold", "0")
    viewer = await (await Viewer(url).connect()).subscribe()
    await viewer.watch()
    assert process.wait() == 3
    assert sum(map(len, viewer.messages.values())) > 100
    print("replay: what is sound of a file that is cut off")


if __name__ == "__main__":
    what, program = sys.argv[1:]
    with tempfile.TemporaryDirectory() as temporary:
        asyncio.run({"live": live, "replay": replay}[what](program, pathlib.Path(temporary)))
