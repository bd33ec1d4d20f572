#include "common/net/keys.h"

#include <fcntl.h>
#include <pwd.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <zmq.hpp>

namespace gapfarm {
namespace {

constexpr std::size_t kKeyText = 40;      // Z85
constexpr std::size_t kFileLimit = 4096;  // bytes

using Fields = std::map<std::string, std::string>;

bool is_key(const std::string& text) {
  std::array<std::uint8_t, 32> bytes = {};
  const bool sound =
      text.size() == kKeyText && zmq_z85_decode(bytes.data(), text.c_str()) != nullptr;
  sodium_memzero(bytes.data(), bytes.size());
  return sound;
}

std::string public_of(const std::string& secret) {
  std::array<char, kKeyText + 1> text = {};
  return zmq_curve_public(text.data(), secret.c_str()) == 0 ? text.data() : "";
}

// Lines "KEY VALUE"; # begins a comment.
Fields parse(const std::string& text) {
  Fields fields;
  std::istringstream in(text);
  std::string line;
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t blank = line.find(' ');
    if (blank != std::string::npos) fields[line.substr(0, blank)] = line.substr(blank + 1);
  }
  return fields;
}

// Empty where there is none.
std::string value_of(const Fields& fields, const char* key) {
  const auto found = fields.find(key);
  return found == fields.end() ? "" : found->second;
}

// `forbidden`: mode bits that the file may not have.
Result<Fields> read_fields(const std::string& path, mode_t forbidden, const char* remedy) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (fd < 0) {
    return Error{"key file '" + path + "': " + strerror(errno) +
                 (errno == ENOENT ? "; see `gapfarm keys --help` for how keys are made" : "")};
  }
  struct stat found = {};
  std::array<char, kFileLimit + 1> bytes = {};
  ssize_t size = -1;
  const bool sound = ::fstat(fd, &found) == 0 && S_ISREG(found.st_mode);
  if (sound) size = ::read(fd, bytes.data(), bytes.size());
  ::close(fd);
  if (!sound || size < 0) return Error{"key file '" + path + "' is no file that can be read"};
  if (found.st_uid != geteuid() && found.st_uid != 0) {
    return Error{"key file '" + path + "' belongs to user " + std::to_string(found.st_uid) +
                 "; only keys of your own are used"};
  }
  if ((found.st_mode & forbidden) != 0) return Error{"key file '" + path + "' " + remedy};
  if (static_cast<std::size_t>(size) > kFileLimit) {
    return Error{"key file '" + path + "' has " + std::to_string(found.st_size) +
                 " bytes and a key file at most " + std::to_string(kFileLimit) +
                 "; remove its comments, or give the file that `gapfarm keys` made"};
  }
  Fields fields = parse(std::string(bytes.data(), static_cast<std::size_t>(size)));
  sodium_memzero(bytes.data(), bytes.size());
  return fields;
}

Status cannot_write(const std::string& path) {
  return Error{"cannot write the key file '" + path + "': " + strerror(errno)};
}

Status write_new(const std::string& path, const std::string& text, mode_t mode) {
  std::string draft = path + ".XXXXXX";
  const int fd = ::mkostemp(draft.data(), O_CLOEXEC);
  if (fd < 0) return cannot_write(path);
  const bool written = ::fchmod(fd, mode) == 0 &&
                       ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       ::fsync(fd) == 0;
  const int linked = written ? ::link(draft.c_str(), path.c_str()) : -1;  // never replaces
  const int error = errno;
  ::close(fd);
  ::unlink(draft.c_str());
  errno = error;
  return linked == 0 ? Status{} : cannot_write(path);
}

// Errors: missing, another user's, readable for others, a link, no key pair in it.
Result<KeyPair> read_key_pair(const std::string& path) {
  ASSIGN_OR_RETURN(
      const Fields fields,
      read_fields(
          path, 077,
          "is open to other users; chmod 600 it, and make a new key if somebody may have looked"));
  KeyPair pair{value_of(fields, "name"), "", value_of(fields, "secret")};
  if (!is_key(pair.secret_key)) return Error{"key file '" + path + "' holds no secret key"};
  pair.public_key = public_of(pair.secret_key);
  const std::string stated = value_of(fields, "public");
  if (stated.empty() || stated != pair.public_key) {
    return Error{"key file '" + path + "' is damaged: its public key is not its secret key's"};
  }
  return pair;
}

// These make a new file (0600, 0644) whole or not at all.  Error: it exists with another key.
Status write_key_pair(const std::string& path, const KeyPair& pair) {
  return write_new(path,
                   "# A gapfarm key.  SECRET: whoever reads this can pose as its owner.\nname " +
                       pair.name + "\npublic " + pair.public_key + "\nsecret " + pair.secret_key +
                       "\n",
                   0600);
}

Status write_public_key(const std::string& path, const PublicKey& key) {
  if (!is_key(key.key))
    return Error{"'" + key.key + "' is no public key: it has 40 characters of Z85"};
  const Status written = write_new(
      path, "# A gapfarm public key.\nname " + key.name + "\npublic " + key.key + "\n", 0644);
  if (written || errno != EEXIST) return written;
  const Result<PublicKey> found = read_public_key(path);
  if (found && found->key == key.key) return {};
  return Error{"'" + path + "' is there already with another key; remove it first"};
}

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

KeyPair make_key_pair(const std::string& name) {
  std::array<char, kKeyText + 1> public_key = {}, secret_key = {};
  zmq_curve_keypair(public_key.data(), secret_key.data());
  KeyPair pair{name, public_key.data(), secret_key.data()};
  sodium_memzero(secret_key.data(), secret_key.size());
  return pair;
}

Result<PublicKey> read_public_key(const std::string& path) {
  ASSIGN_OR_RETURN(
      const Fields fields,
      read_fields(path, 022, "can be changed by other users; chmod 644 it after a look into it"));
  PublicKey key{value_of(fields, "name"), value_of(fields, "public")};
  if (!is_key(key.key)) return Error{"key file '" + path + "' holds no public key"};
  return key;
}

bool is_key_name(std::string_view name) {
  if (name.empty() || name.size() > 64 || !std::isalnum(static_cast<unsigned char>(name[0]))) {
    return false;
  }
  return std::ranges::all_of(
      name, [](unsigned char c) { return std::isalnum(c) || c == '.' || c == '_' || c == '-'; });
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
  std::ranges::sort(keys, {}, &PublicKey::name);
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
