#include "master/io/robot_files/urdf/urdf.h"

#include <set>

#include "common/base/suggest.h"
#include "common/trials/text/csv.h"
#include "master/io/robot_files/urdf/urdf_xml.h"

namespace gapfarm {
namespace {

std::string at_line(const std::string& file, int line) {
  return file + ":" + std::to_string(line) + ": ";
}

// The one link that is nobody's child, when everything hangs together.
Status check_tree(UrdfModel& model) {
  std::map<std::string, const UrdfJoint*, std::less<>> above;
  std::set<std::string, std::less<>> names;
  std::vector<std::string> known;
  for (const UrdfLink& link : model.links) {
    if (!names.insert(link.name).second) {
      return Error{at_line(model.file, link.line) + "found link " + quoted_word(link.name) +
                   " again, expected each name once; rename one of the two"};
    }
    known.push_back(link.name);
  }
  for (const UrdfJoint& joint : model.joints) {
    for (const std::string& end : {joint.parent, joint.child}) {
      if (names.count(end) == 0) {
        return Error{at_line(model.file, joint.line) + "joint " + quoted_word(joint.name) +
                     " names link " + quoted_word(end) + ", which the file does not have" +
                     suggestion(end, known)};
      }
    }
    if (!above.emplace(joint.child, &joint).second) {
      return Error{at_line(model.file, joint.line) + "found a second joint above link " +
                   quoted_word(joint.child) + ", expected one; a URDF is a tree"};
    }
  }
  for (const UrdfLink& link : model.links) {
    if (above.count(link.name) != 0) continue;
    if (!model.root.empty()) {
      return Error{at_line(model.file, link.line) + "found a second root link " +
                   quoted_word(link.name) + " beside " + quoted_word(model.root) +
                   ", expected one; join the two by a joint or remove one"};
    }
    model.root = link.name;
  }
  if (model.root.empty()) {
    return Error{at_line(model.file, 1) +
                 "found joints that run in a circle, expected one link that is nobody's child"};
  }
  return {};
}

}  // namespace

const UrdfLink* UrdfModel::find_link(std::string_view wanted) const {
  for (const UrdfLink& link : links) {
    if (link.name == wanted) return &link;
  }
  return nullptr;
}

const UrdfJoint* UrdfModel::find_joint(std::string_view wanted) const {
  for (const UrdfJoint& joint : joints) {
    if (joint.name == wanted) return &joint;
  }
  return nullptr;
}

const UrdfJoint* UrdfModel::joint_above(std::string_view link) const {
  for (const UrdfJoint& joint : joints) {
    if (joint.child == link) return &joint;
  }
  return nullptr;
}

Result<UrdfModel> parse_urdf(std::string_view text, const std::string& file) {
  Result<UrdfModel> model = read_urdf_xml(text, file);
  if (!model) return model;
  if (model->links.empty()) {
    return Error{at_line(file, 1) + "found no <link>, expected a robot's links and joints"};
  }
  if (Status status = check_tree(*model); !status) return status.error();
  if (link_poses(*model).size() != model->links.size()) {
    return Error{at_line(file, 1) +
                 "found links that hang on one another in a circle, expected all of them to hang "
                 "on " +
                 quoted_word(model->root)};
  }
  return model;
}

std::map<std::string, Eigen::Isometry3d, std::less<>> link_poses(const UrdfModel& model) {
  std::multimap<std::string_view, const UrdfJoint*> below;
  for (const UrdfJoint& joint : model.joints) below.emplace(joint.parent, &joint);
  std::map<std::string, Eigen::Isometry3d, std::less<>> poses;
  std::vector<std::string> open = {model.root};
  poses[model.root] = Eigen::Isometry3d::Identity();
  while (!open.empty()) {
    const std::string parent = std::move(open.back());
    open.pop_back();
    const auto [begin, end] = below.equal_range(parent);
    for (auto it = begin; it != end; ++it) {
      poses[it->second->child] = poses[parent] * it->second->X_PJ;
      open.push_back(it->second->child);
    }
  }
  return poses;
}

}  // namespace gapfarm
