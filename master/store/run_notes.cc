// What a run store keeps beside generations and the live row.
#include "common/base/try.h"
#include "master/store/run_store.h"

namespace gapfarm {

Status RunStore::add_incident(IncidentKind kind, const std::string& text) {
  return database_.run("write down what happened", "INSERT INTO incidents VALUES (?, ?, ?, ?)",
                       next_generation(), incident_name(kind), unix_now_s(), text);
}

Status RunStore::add_worker_events(const std::vector<StoredWorkerEvent>& events) {
  if (events.empty()) return {};
  ASSIGN_OR_RETURN(SqlTransaction transaction, SqlTransaction::begin(database_));
  RETURN_IF_ERROR(insert_worker_events(events));
  return transaction.commit();
}

Status RunStore::insert_worker_events(const std::vector<StoredWorkerEvent>& events) {
  ASSIGN_OR_RETURN(SqlStatement insert,
                   database_.prepare("INSERT INTO worker_events VALUES (?, ?, ?, ?, ?)",
                                     "write down who came and went"));
  for (const StoredWorkerEvent& e : events) {
    RETURN_IF_ERROR(insert.bind_all(e.unix_s, e.kind, e.worker, e.host, e.text).run());
  }
  return {};
}

Status RunStore::keep_document(const std::string& name, const std::string& json) {
  return database_.run("keep " + name, "INSERT OR REPLACE INTO documents VALUES (?, ?, ?)", name,
                       last_generation_.value_or(0), json);
}

}  // namespace gapfarm
