#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>

namespace flyball {

/// Why a file of a planning tool cannot be read.
enum class MotionFileError {
  not_json,     ///< Broken JSON, told with line and column.
  wrong_kind,   ///< JSON, but of something else.
  wrong_field,  ///< A field that is missing, of another type, or that cannot be.
  too_large,    ///< More bytes, values or brackets inside each other than a file of this kind has.
};
[[nodiscard]] ErrorInfo error_info(MotionFileError code);

namespace io {
/// A value of a text.
struct JsonNode;
/// A text and its values.
struct JsonTree;
}  // namespace io

/// Where a part of a file was read from. The writers take what stands there for all that the part
/// itself does not say: members that Flyball does not know, their order, blanks, and how a number
/// is spelt that has not changed. A copy shares the file's text; a part without an origin is
/// written as its tool would.
class JsonOrigin {
 public:
  /// Of what no file had.
  JsonOrigin() = default;
  /// @param node  Of the tree.
  JsonOrigin(std::shared_ptr<const io::JsonTree> tree, const io::JsonNode& node) noexcept
      : tree_(std::move(tree)), node_(&node) {}

  [[nodiscard]] const io::JsonNode* node() const noexcept { return node_; }
  [[nodiscard]] const io::JsonTree* tree() const noexcept { return tree_.get(); }
  /// Line and column; 1, 1 of what comes from no file. Cost: O(size of the file before it);
  /// `places_of` for many.
  [[nodiscard]] Place place() const;

 private:
  std::shared_ptr<const io::JsonTree> tree_{};
  const io::JsonNode* node_ = nullptr;
};

/// Where parts stand. Cost: O(size of their file) for parts in its order.
[[nodiscard]] std::vector<Place> places_of(std::span<const JsonOrigin> origins);

/// The keys of the outermost object of a JSON text; none of a list. @errors MotionFileError.
[[nodiscard]] ExpectedAll<std::vector<std::string>> json_keys(std::string_view text,
                                                              const std::string& source);

}  // namespace flyball
