// gapfarm keys: who may work for this user's masters.
#include "common/net/keys.h"

#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "master/cli/subcommand.h"

namespace gapfarm {
namespace {

struct KeysOptions {
  std::string folder = KeyFolder::default_path();
  std::string name;
  std::string file;
  std::string key;
  std::string out;
  bool worker_only = false;
};

std::string key_name_of_host() { return is_key_name(host_name()) ? host_name() : "worker"; }

Json key_json(const std::string& folder, const std::string& worker, const std::string& public_key) {
  return {{"folder", folder}, {"worker", worker}, {"public", public_key}};
}

// A worker's pair in `folder`: the one that is there, else a new one.
Result<KeyPair> worker_pair(const KeyFolder& folder, const std::string& name) {
  if (folder.has_pair("worker")) return folder.pair("worker");
  const KeyPair pair = make_key_pair(name);
  RETURN_IF_ERROR(folder.add_pair("worker", pair));
  return pair;
}

Status make_master(const KeyFolder& folder, Console& console) {
  if (folder.has_pair("master")) {
    console.note("master.key is there already and stays");
  } else
    RETURN_IF_ERROR(folder.add_pair("master", make_key_pair("master")));
  ASSIGN_OR_RETURN(const KeyPair pair, folder.pair("master"));
  return folder.add_master_public({"master", pair.public_key});
}

Result<int> run_make(const KeysOptions& options, CliContext& context) {
  Console& console = context.console;
  ASSIGN_OR_RETURN(const KeyFolder folder, KeyFolder::open_or_make(options.folder));
  if (folder.has_pair("worker")) console.note("worker.key is there already and stays");
  ASSIGN_OR_RETURN(const KeyPair worker,
                   worker_pair(folder, options.name.empty() ? key_name_of_host() : options.name));
  context.begun = true;
  if (options.worker_only) {
    console.result("made the key of worker '" + worker.name + "' in " + folder.path() +
                       "\nput master.pub of the master's key folder there, and list the worker on "
                       "the master with\n  gapfarm keys allow " +
                       worker.name + " --key '" + worker.public_key + "'\n",
                   key_json(folder.path(), worker.name, worker.public_key));
    return kExitDone;
  }
  RETURN_IF_ERROR(make_master(folder, console));
  RETURN_IF_ERROR(folder.list({worker.name, worker.public_key}));
  console.result("keys of a master, and of the workers of this user on '" + worker.name +
                     "' (and wherever this folder is shared), are in " + folder.path() +
                     "\nfor another machine: gapfarm keys worker NAME --out FOLDER\n",
                 key_json(folder.path(), worker.name, worker.public_key));
  return kExitDone;
}

// Key folder of a worker elsewhere, made here.
Result<int> run_worker(const KeysOptions& options, CliContext& context) {
  ASSIGN_OR_RETURN(const KeyFolder folder, KeyFolder::open(options.folder));
  ASSIGN_OR_RETURN(const PublicKey master, folder.master_public());
  ASSIGN_OR_RETURN(const KeyFolder other, KeyFolder::open_or_make(options.out));
  ASSIGN_OR_RETURN(const KeyPair worker, worker_pair(other, options.name));
  context.begun = true;
  RETURN_IF_ERROR(other.add_master_public(master));
  RETURN_IF_ERROR(folder.list({options.name, worker.public_key}));
  context.console.result(
      "listed worker '" + options.name + "'; copy its folder over and remove it here:\n  scp -rp " +
          options.out + " HOST:.config/gapfarm/keys && rm -r " + options.out + "\n",
      key_json(options.out, options.name, worker.public_key));
  return kExitDone;
}

Result<int> run_allow(const KeysOptions& options, CliContext& context) {
  if (options.file.empty() == options.key.empty()) {
    return Error{"give either the worker's public key file or --key KEY"};
  }
  ASSIGN_OR_RETURN(const KeyFolder folder, KeyFolder::open(options.folder));
  PublicKey key{options.name, options.key};
  if (!options.file.empty()) {
    ASSIGN_OR_RETURN(const PublicKey read, read_public_key(options.file));
    key.key = read.key;
  }
  RETURN_IF_ERROR(folder.list(key));
  context.console.result("listed worker '" + options.name + "'\n",
                         key_json(folder.path(), options.name, key.key));
  return kExitDone;
}

Result<int> run_revoke(const KeysOptions& options, CliContext& context) {
  ASSIGN_OR_RETURN(const KeyFolder folder, KeyFolder::open(options.folder));
  RETURN_IF_ERROR(folder.unlist(options.name));
  context.console.result("worker '" + options.name +
                             "' is not listed any more; links that stand go on until they break or "
                             "the master restarts\n",
                         {{"folder", folder.path()}, {"revoked", options.name}});
  return kExitDone;
}

Result<int> run_list(const KeysOptions& options, CliContext& context) {
  ASSIGN_OR_RETURN(const KeyFolder folder, KeyFolder::open(options.folder));
  Json rows = Json::array();
  std::vector<std::string> trouble;
  const auto row = [&](const char* role, const std::string& name, const std::string& key) {
    rows.push_back({{"role", role}, {"name", name}, {"public", key}});
  };
  for (const char* role : {"master", "worker"}) {
    if (!folder.has_pair(role)) continue;
    const Result<KeyPair> pair = folder.pair(role);
    if (pair) {
      row(role, pair->name, pair->public_key);
    } else {
      trouble.push_back(pair.error().message);
    }
  }
  ASSIGN_OR_RETURN(const auto listed, folder.listed(&trouble));
  for (const PublicKey& key : listed) row("listed", key.name, key.key);
  std::string lines;
  for (const auto& entry : rows) {
    const std::string role = entry["role"], name = entry["name"], public_key = entry["public"];
    lines += role + std::string(8 - role.size(), ' ') + public_key + "  " + printable(name) + "\n";
  }
  context.console.result(lines, rows);
  if (rows.empty()) context.console.note("no keys in " + folder.path());
  for (const std::string& text : trouble) context.console.error(Error{text});
  return trouble.empty() ? kExitDone : kExitFailed;
}

using KeysRun = Result<int> (*)(const KeysOptions&, CliContext&);

}  // namespace

SubcommandRun setup_keys(CLI::App& app) {
  auto options = std::make_shared<KeysOptions>();
  auto chosen = std::make_shared<KeysRun>(nullptr);
  // A parent's examples are not its children's.
  const auto add = [&](const char* name, const char* summary, KeysRun run, const char* examples) {
    CLI::App* sub = app.add_subcommand(name, summary)->footer(examples);
    sub->add_option("--keys", options->folder, "Key folder (default: ~/.config/gapfarm/keys)")
        ->type_name("FOLDER");
    sub->callback([chosen, run] { *chosen = run; });
    return sub;
  };
  const CLI::Validator name(
      [](const std::string& text) {
        return is_key_name(text) ? "" : "'" + text + "' is not 1 to 64 of A-Z a-z 0-9 . _ -";
      },
      "NAME");
  const auto add_name = [&](CLI::App* sub) {
    sub->add_option("NAME", options->name, "Of the worker")->required()->check(name);
  };
  CLI::App* make = add(
      "make", "make the keys of a master and of this machine's workers", run_make,
      "Examples:\n"
      "  gapfarm keys make                       # once, for master and local workers\n"
      "  gapfarm keys make --worker --name rack4 # on rack4, to be let in by `gapfarm keys allow`");
  make->add_flag("--worker", options->worker_only, "Only those of this machine's workers");
  make->add_option("--name", options->name, "The worker's name (default: the host's)")->check(name);
  CLI::App* worker =
      add("worker", "make the key folder of another machine's workers", run_worker,
          "Examples:\n"
          "  gapfarm keys worker rack3 --out /tmp/rack3   # then copy the folder to rack3");
  add_name(worker);
  worker->add_option("--out", options->out, "Folder to make")->required();
  CLI::App* allow = add("allow", "let in a worker that has made its own key", run_allow,
                        "Examples:\n"
                        "  gapfarm keys allow rack4 rack4.pub\n"
                        "  gapfarm keys allow rack4 --key KEY");
  add_name(allow);
  allow->add_option("FILE", options->file, "Public key file");
  allow->add_option("--key", options->key, "The public key itself (40 characters)");
  add_name(add("revoke", "let a worker in no more", run_revoke,
               "Examples:\n"
               "  gapfarm keys revoke rack4"));
  add("list", "show public keys and who is let in", run_list,
      "Examples:\n"
      "  gapfarm keys list\n"
      "  gapfarm keys list --json | jq .[].name");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  gapfarm keys make                                 # once, for master and local workers\n"
      "  gapfarm keys worker rack3 --out /tmp/rack3        # then copy the folder to rack3\n"
      "  gapfarm keys allow rack4 rack4.pub                # rack4 ran `gapfarm keys make "
      "--worker`\n"
      "  gapfarm keys list\n"
      "Secret keys stay in files of mode 0600 in a folder of mode 0700; nothing else is accepted.\n"
      "A running master notices changes of the list within a second.");
  return [options, chosen](CliContext& context) { return (*chosen)(*options, context); };
}

}  // namespace gapfarm
