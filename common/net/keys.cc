#include "common/net/keys.h"

#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "common/base/try.h"
#include "common/net/key_file.h"

namespace gapfarm {
namespace {

std::string home_folder() {
  if (const char* home = getenv("HOME"); home != nullptr && *home == '/') return home;
  const passwd* entry = getpwuid(geteuid());
  return entry != nullptr ? entry->pw_dir : "/";
}

Status check_folder(const std::string& path) {
  struct stat found = {};
  if (::stat(path.c_str(), &found) != 0) {
    return Error{"key folder '" + path + "': " + strerror(errno) +
                 "; make keys with `gapfarm keys make`, or name their folder with --keys"};
  }
  if (!S_ISDIR(found.st_mode)) return Error{"key folder '" + path + "' is not a folder"};
  if (found.st_uid != geteuid()) {
    return Error{"key folder '" + path + "' belongs to user " + std::to_string(found.st_uid) +
                 " and not to you (" + std::to_string(geteuid()) + "); use a folder of your own"};
  }
  if ((found.st_mode & 077) != 0) {
    return Error{"key folder '" + path +
                 "' is open to other users; chmod 700 it, and make new keys " +
                 "if somebody may have looked"};
  }
  return {};
}

Status make_private_folder(const std::string& path) {
  if (::mkdir(path.c_str(), 0700) == 0 || errno == EEXIST) return {};
  return Error{"cannot make the folder '" + path + "': " + strerror(errno)};
}

}  // namespace

bool is_key_name(std::string_view name) {
  if (name.empty() || name.size() > 64 || !std::isalnum(static_cast<unsigned char>(name[0]))) {
    return false;
  }
  return std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '.' || c == '_' || c == '-';
  });
}

Result<std::vector<PublicKey>> read_listed_keys(const std::string& folder,
                                                std::vector<std::string>* trouble) {
  std::vector<PublicKey> keys;
  std::error_code error;
  std::filesystem::directory_iterator entry(folder, error);
  if (error == std::errc::no_such_file_or_directory) return keys;
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    if (entry->path().extension() != ".pub") continue;
    Result<PublicKey> key = read_public_key(entry->path());
    if (key) {
      key->name = entry->path().stem();
      keys.push_back(std::move(*key));
    } else if (trouble != nullptr) {
      trouble->push_back(key.error().message);
    }
  }
  if (error) return Error{"cannot read the key folder '" + folder + "': " + error.message()};
  std::sort(keys.begin(), keys.end(),
            [](const PublicKey& a, const PublicKey& b) { return a.name < b.name; });
  return keys;
}

std::string KeyFolder::default_path() {
  const char* config = getenv("XDG_CONFIG_HOME");
  const std::string base =
      config != nullptr && *config == '/' ? std::string(config) : home_folder() + "/.config";
  return base + "/gapfarm/keys";
}

Result<KeyFolder> KeyFolder::open(const std::string& path) {
  RETURN_IF_ERROR(check_folder(path));
  return KeyFolder(path);
}

Result<KeyFolder> KeyFolder::open_or_make(const std::string& path) {
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (!parent.empty()) std::filesystem::create_directories(parent, error);
  if (error) return Error{"cannot make the folder '" + parent.string() + "': " + error.message()};
  RETURN_IF_ERROR(make_private_folder(path));
  return open(path);
}

bool KeyFolder::has_pair(const std::string& role) const {
  return ::access((path_ + "/" + role + ".key").c_str(), F_OK) == 0;
}

Result<KeyPair> KeyFolder::pair(const std::string& role) const {
  return read_key_pair(path_ + "/" + role + ".key");
}

Status KeyFolder::add_pair(const std::string& role, const KeyPair& pair) const {
  RETURN_IF_ERROR(write_key_pair(path_ + "/" + role + ".key", pair));
  return write_public_key(path_ + "/" + role + ".pub", {pair.name, pair.public_key});
}

Result<PublicKey> KeyFolder::master_public() const {
  return read_public_key(path_ + "/master.pub");
}

Status KeyFolder::add_master_public(const PublicKey& key) const {
  return write_public_key(path_ + "/master.pub", key);
}

Result<std::vector<PublicKey>> KeyFolder::listed(std::vector<std::string>* trouble) const {
  return read_listed_keys(listed_path(), trouble);
}

Status KeyFolder::list(const PublicKey& key) const {
  if (!is_key_name(key.name)) {
    return Error{"'" + key.name + "' names no key: use 1 to 64 of A-Z a-z 0-9 . _ -, beginning " +
                 "with a letter or digit"};
  }
  RETURN_IF_ERROR(make_private_folder(listed_path()));
  return write_public_key(listed_path() + "/" + key.name + ".pub", key);
}

Status KeyFolder::unlist(const std::string& name) const {
  const std::string path = listed_path() + "/" + name + ".pub";
  if (is_key_name(name) && ::unlink(path.c_str()) == 0) return {};
  return Error{"no key of the name '" + name + "' is listed in '" + listed_path() +
               "'; see `gapfarm keys list`"};
}

Result<LinkSecurity> master_security(const std::string& folder) {
  ASSIGN_OR_RETURN(const KeyFolder keys, KeyFolder::open(folder));
  ASSIGN_OR_RETURN(KeyPair own, keys.pair("master"));
  LinkSecurity security;
  security.own = std::move(own);
  security.listed = keys.listed_path();
  return security;
}

Result<LinkSecurity> worker_security(const std::string& folder) {
  ASSIGN_OR_RETURN(const KeyFolder keys, KeyFolder::open(folder));
  ASSIGN_OR_RETURN(KeyPair own, keys.pair("worker"));
  ASSIGN_OR_RETURN(const PublicKey master, keys.master_public());
  LinkSecurity security;
  security.own = std::move(own);
  security.master_key = master.key;
  return security;
}

}  // namespace gapfarm
