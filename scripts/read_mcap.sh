#!/usr/bin/env bash
# Reads an MCAP file by the format's own reader in JavaScript, @mcap/core, which npm fetches into a
# folder that is thrown away: by its index and as a stream.  One line a topic: messages, first and
# last time, the last message.
#
#   scripts/read_mcap.sh FILE
set -euo pipefail

file=$(realpath "$1")
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
npm init -y >said 2>&1 && npm install @mcap/core >>said 2>&1 || { cat said >&2; exit 1; }
cat >read.mjs <<'END'
import { readFileSync } from "node:fs";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
const bytes = new Uint8Array(readFileSync(process.argv[2]));
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (at, size) => bytes.slice(Number(at), Number(at + size)),
};
const reader = await McapIndexedReader.Initialize({ readable });
const topics = new Map();
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const json = JSON.parse(new TextDecoder().decode(message.data));
  for (const name of Object.keys(json))
    if (!(name in JSON.parse(new TextDecoder().decode(schema.data)).properties)) throw name;
  const of = topics.get(channel.topic) ?? { schema: schema.name, count: 0, first: message.logTime };
  of.count++;
  of.last = message.logTime;
  of.json = json;
  topics.set(channel.topic, of);
}
let streamed = 0;
const stream = new McapStreamReader();
stream.append(bytes);
for (let r; (r = stream.nextRecord()); ) streamed += r.type === "Message";
const indexed = [...topics.values()].reduce((sum, t) => sum + t.count, 0);
if (!stream.done() || streamed !== indexed) throw `${streamed} streamed, ${indexed} by the index`;
for (const [topic, t] of topics)
  console.log(`${topic} (${t.schema}): ${t.count} messages, ${Number(t.first) / 1e9} to ` +
              `${Number(t.last) / 1e9} s; ${JSON.stringify(t.json)}`);
console.log(`${indexed} messages by the index, as many as a stream`);
END
node read.mjs "$file"
