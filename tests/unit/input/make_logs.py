#!/usr/bin/env python3
"""Writes data/: one small drive in every kind of bag, by the formats' descriptions alone.

    tests/unit/input/make_logs.py      (needs the programs lz4 and zstd)

Twelve poses (x = 0.1 i, y = -0.05 i, yaw = 0.3 i - 1.5; stamped 3 ms before they were recorded) and
24 twists (v = 0.5 + 0.01 i, omega = 0.1 - 0.02 i), with topics beside them that nobody needs.
"""
import bz2
import math
import pathlib
import sqlite3
import struct
import subprocess

OUT = pathlib.Path(__file__).parent / 'data'
START_NS = 1_700_000_000_500_000_000
HEADER1 = 'uint32 seq\ntime stamp\nstring frame_id\n'
POSE_TEXT = ('std_msgs/Header header\ngeometry_msgs/Pose pose\n'
             '================\nMSG: std_msgs/Header\n%s'
             '================\nMSG: geometry_msgs/Pose\ngeometry_msgs/Point position\n'
             'geometry_msgs/Quaternion orientation\n'
             '================\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y # m\nfloat64 z\n'
             '================\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n')
HEADER2 = ('builtin_interfaces/Time stamp\nstring frame_id\n'
           '================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n')
TWIST_TEXT = ('Vector3 linear\nVector3 angular\n'
              '================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n')
JOINT_TEXT = ('Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n'
              '================\nMSG: std_msgs/Header\n' + HEADER1)
IMAGE_TEXT = 'std_msgs/Header header\nstring format\nuint8[] data\n'


def text1(s):
    return struct.pack('<I', len(s)) + s.encode()


def stamp1(ns):
    return struct.pack('<II', ns // 10**9, ns % 10**9)


def drive():
    """(recorded ns, topic, values) in order."""
    rows = []
    for i in range(12):
        yaw = 0.3 * i - 1.5
        t = START_NS + i * 100_000_000
        pose = (0.1 * i, -0.05 * i, 0.02, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
        rows.append((t + 3_000_000, '/pose', (t, pose)))
        rows.append((t + 4_000_000, '/joint_states', (t, (3.0 * i, -3.0 * i))))
    for i in range(24):
        t = START_NS + 1_000_000 + i * 50_000_000
        rows.append((t, '/cmd_vel', (0.5 + 0.01 * i, 0, 0, 0, 0, 0.1 - 0.02 * i)))
    rows.append((START_NS, '/camera', b'\x01\x02\x03'))
    return sorted(rows, key=lambda row: row[0])


def ros1(topic, values):
    if topic == '/pose':
        t, pose = values
        return struct.pack('<I', 7) + stamp1(t) + text1('map') + struct.pack('<7d', *pose)
    if topic == '/joint_states':
        t, speeds = values
        return (struct.pack('<I', 7) + stamp1(t) + text1('') + struct.pack('<I', 2) + text1('left')
                + text1('right') + struct.pack('<I', 0) + struct.pack('<I2d', 2, *speeds)
                + struct.pack('<I', 0))
    if topic == '/cmd_vel':
        return struct.pack('<6d', *values)
    return struct.pack('<I', 0) + stamp1(0) + text1('') + text1('jpeg') + text1('abc')


class Cdr:
    def __init__(self):
        self.bytes = b''

    def put(self, form, value):
        size = struct.calcsize(form)
        self.bytes += b'\0' * (-len(self.bytes) % size) + struct.pack('<' + form, value)
        return self

    def text(self, s):
        self.put('I', len(s) + 1)
        self.bytes += s.encode() + b'\0'
        return self

    def done(self):
        return b'\0\1\0\0' + self.bytes


def cdr(topic, values):
    c = Cdr()
    if topic == '/pose':
        t, pose = values
        c.put('i', t // 10**9).put('I', t % 10**9).text('odom_map')
        for v in pose:
            c.put('d', v)
    elif topic == '/joint_states':
        t, speeds = values
        c.put('i', t // 10**9).put('I', t % 10**9).text('')
        c.put('I', 2).text('left').text('right').put('I', 0).put('I', 2)
        for v in speeds:
            c.put('d', v)
        c.put('I', 0)
    elif topic == '/cmd_vel':
        for v in values:
            c.put('d', v)
    else:
        c.put('I', 3)
        c.bytes += b'abc'
    return c.done()


TYPES = {'/pose': 'geometry_msgs/PoseStamped', '/cmd_vel': 'geometry_msgs/Twist',
         '/joint_states': 'sensor_msgs/JointState', '/camera': 'sensor_msgs/CompressedImage'}


def run(program, data):
    return subprocess.run(program, input=data, stdout=subprocess.PIPE, check=True).stdout


PACK = {'none': lambda d: d, '': lambda d: d, 'bz2': bz2.compress,
        'lz4': lambda d: run(['lz4', '-c', '-'], d), 'zstd': lambda d: run(['zstd', '-c'], d)}


def bag(how):
    def head(**fields):
        out = b''
        for name, value in fields.items():
            field = name.encode() + b'=' + value
            out += struct.pack('<I', len(field)) + field
        return out

    def record(data, **fields):
        h = head(**fields)
        return struct.pack('<I', len(h)) + h + struct.pack('<I', len(data)) + data

    texts = {'/pose': POSE_TEXT % HEADER1, '/cmd_vel': TWIST_TEXT, '/joint_states': JOINT_TEXT,
             '/camera': IMAGE_TEXT}
    ids = {topic: i for i, topic in enumerate(TYPES)}
    rows = drive()
    chunks, connections = b'', b''
    for half in (rows[:20], rows[20:]):
        inside = b''
        for topic, i in ids.items():
            data = head(topic=topic.encode(), type=TYPES[topic].encode(), md5sum=b'0' * 32,
                        message_definition=texts[topic].encode())
            c = record(data, op=b'\x07', conn=struct.pack('<I', i), topic=topic.encode())
            inside += c
        for ns, topic, values in half:
            inside += record(ros1(topic, values), op=b'\x02', conn=struct.pack('<I', ids[topic]),
                             time=stamp1(ns))
        chunks += record(PACK[how](inside), op=b'\x05', compression=how.encode(),
                         size=struct.pack('<I', len(inside)))
        chunks += record(b'\0' * 12, op=b'\x04', ver=struct.pack('<I', 1),
                         conn=struct.pack('<I', 0), count=struct.pack('<I', 1))
    start = record(b' ' * 64, op=b'\x03', index_pos=struct.pack('<Q', 0),
                   conn_count=struct.pack('<I', 4), chunk_count=struct.pack('<I', 2))
    return b'#ROSBAG V2.0\n' + start + chunks + connections


def mcap(how, encoding):
    def record(op, data):
        return struct.pack('<BQ', op, len(data)) + data

    two = encoding == 'cdr'
    texts = {'/pose': POSE_TEXT % (HEADER2 if two else HEADER1), '/cmd_vel': TWIST_TEXT,
             '/joint_states': JOINT_TEXT.replace(HEADER1, HEADER2) if two else JOINT_TEXT,
             '/camera': IMAGE_TEXT}
    inside = b''
    for i, topic in enumerate(TYPES):
        name = TYPES[topic].replace('/', '/msg/') if two else TYPES[topic]
        schema = texts[topic].replace('Header header', 'std_msgs/Header header').replace(
            'std_msgs/std_msgs', 'std_msgs')
        inside += record(3, struct.pack('<H', i + 1) + text1(name)
                         + text1('ros2msg' if two else 'ros1msg') + text1(schema))
        inside += record(4, struct.pack('<HH', i, i + 1) + text1(topic) + text1(encoding)
                         + struct.pack('<I', 0))
    ids = {topic: i for i, topic in enumerate(TYPES)}
    for ns, topic, values in drive():
        data = (cdr if two else ros1)(topic, values)
        inside += record(5, struct.pack('<HIQQ', ids[topic], 0, ns, ns) + data)
    magic = b'\x89MCAP0\r\n'
    out = magic + record(1, text1('ros2' if two else 'ros1') + text1('test'))
    if how is None:
        out += inside
    else:
        packed = PACK[how](inside)
        out += record(6, struct.pack('<QQQI', 0, 0, len(inside), 0) + text1(how)
                      + struct.pack('<Q', len(packed)) + packed)
    out += record(0x0f, struct.pack('<I', 0)) + record(2, struct.pack('<QQI', 0, 0, 0))
    return out + magic


def db3(path):
    path.unlink(missing_ok=True)
    base = sqlite3.connect(path)
    base.execute('CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, '
                 'serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)')
    base.execute('CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, '
                 'timestamp INTEGER NOT NULL, data BLOB NOT NULL)')
    ids = {topic: i + 1 for i, topic in enumerate(TYPES)}
    for topic, i in ids.items():
        base.execute('INSERT INTO topics VALUES(?, ?, ?, ?, ?)',
                     (i, topic, TYPES[topic].replace('/', '/msg/'), 'cdr', ''))
    for ns, topic, values in drive():
        base.execute('INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)',
                     (ids[topic], ns, cdr(topic, values)))
    base.commit()
    base.close()


OUT.mkdir(exist_ok=True)
for how in ('none', 'bz2', 'lz4'):
    (OUT / f'ros1_{how}.bag').write_bytes(bag(how))
(OUT / 'cdr_plain.mcap').write_bytes(mcap(None, 'cdr'))
(OUT / 'cdr_zstd.mcap').write_bytes(mcap('zstd', 'cdr'))
(OUT / 'ros1_lz4.mcap').write_bytes(mcap('lz4', 'ros1'))
db3(OUT / 'cdr.db3')
