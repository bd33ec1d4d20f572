#include "common/net/key_file.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <sstream>
#include <zmq.hpp>

#include "common/base/try.h"

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

// `forbidden`: mode bits that the file may not have.
Result<Fields> read_fields(const std::string& path, mode_t forbidden, const char* remedy) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (fd < 0) {
    return Error{"key file '" + path + "': " + strerror(errno) +
                 (errno == ENOENT ? "; see `gapfarm keys --help` for how keys are made" : "")};
  }
  struct stat found = {};
  std::array<char, kFileLimit> bytes = {};
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
  PublicKey key;
  if (const auto name = fields.find("name"); name != fields.end()) key.name = name->second;
  if (const auto text = fields.find("public"); text != fields.end()) key.key = text->second;
  if (!is_key(key.key)) return Error{"key file '" + path + "' holds no public key"};
  return key;
}

Result<KeyPair> read_key_pair(const std::string& path) {
  ASSIGN_OR_RETURN(
      const Fields fields,
      read_fields(path, 077,
                  "is open to other users; chmod 600 it, and make a new key if somebody may have "
                  "looked"));
  KeyPair pair;
  if (const auto name = fields.find("name"); name != fields.end()) pair.name = name->second;
  if (const auto text = fields.find("secret"); text != fields.end()) {
    pair.secret_key = text->second;
  }
  if (!is_key(pair.secret_key)) return Error{"key file '" + path + "' holds no secret key"};
  pair.public_key = public_of(pair.secret_key);
  if (const auto text = fields.find("public");
      text == fields.end() || text->second != pair.public_key) {
    return Error{"key file '" + path + "' is damaged: its public key is not its secret key's"};
  }
  return pair;
}

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

}  // namespace gapfarm
