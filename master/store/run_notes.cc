// What a run store keeps beside generations and the live row.
#include "master/store/run_store.h"

namespace gapfarm {

Status RunStore::add_incident(IncidentKind kind, const std::string& text) {
  Result<SqlStatement> insert =
      database_.prepare("INSERT INTO incidents VALUES (?, ?, ?, ?)", "write down what happened");
  if (!insert) return insert.error();
  insert->bind(1, static_cast<std::int64_t>(next_generation()));
  insert->bind_text(2, incident_name(kind)).bind(3, unix_now_s()).bind_text(4, text);
  return insert->run();
}

Status RunStore::add_worker_events(const std::vector<StoredWorkerEvent>& events) {
  if (events.empty()) return {};
  Result<SqlTransaction> transaction = SqlTransaction::begin(database_);
  if (!transaction) return transaction.error();
  if (Status s = insert_worker_events(events); !s) return s;
  return transaction->commit();
}

Status RunStore::insert_worker_events(const std::vector<StoredWorkerEvent>& events) {
  Result<SqlStatement> insert = database_.prepare(
      "INSERT INTO worker_events VALUES (?, ?, ?, ?, ?)", "write down who came and went");
  if (!insert) return insert.error();
  for (const StoredWorkerEvent& event : events) {
    insert->bind(1, event.unix_s).bind_text(2, event.kind).bind_text(3, event.worker);
    insert->bind_text(4, event.host).bind_text(5, event.text);
    if (Status s = insert->run(); !s) return s;
  }
  return {};
}

Status RunStore::keep_document(const std::string& name, const std::string& json) {
  Result<SqlStatement> insert =
      database_.prepare("INSERT OR REPLACE INTO documents VALUES (?, ?, ?)", "keep " + name);
  if (!insert) return insert.error();
  insert->bind_text(1, name);
  insert->bind(2, static_cast<std::int64_t>(last_generation_.value_or(0)));
  insert->bind_text(3, json);
  return insert->run();
}

}  // namespace gapfarm
