#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// A JSON value as a few flat lists, which no destructor walks through.
namespace flyball::solve {

class JsonTree;

enum class JsonType : std::uint8_t { null, boolean, number, string, array, object };

/// A value of a tree, which must outlive it.
class JsonValue {
 public:
  [[nodiscard]] JsonType type() const noexcept;
  [[nodiscard]] bool is_null() const noexcept { return type() == JsonType::null; }
  [[nodiscard]] bool is_number() const noexcept { return type() == JsonType::number; }
  [[nodiscard]] bool is_string() const noexcept { return type() == JsonType::string; }
  [[nodiscard]] bool is_array() const noexcept { return type() == JsonType::array; }
  [[nodiscard]] bool is_object() const noexcept { return type() == JsonType::object; }
  [[nodiscard]] bool is_structured() const noexcept { return is_array() || is_object(); }

  /// Of a number; true and false are 1 and 0.
  [[nodiscard]] double number() const noexcept;
  /// Of a string.
  [[nodiscard]] std::string_view text() const noexcept;
  /// How many elements or members; 0 of what has none.
  [[nodiscard]] std::size_t size() const noexcept;
  [[nodiscard]] bool empty() const noexcept { return size() == 0; }

  /// Elements of an array, members of an object in the order of the text.
  class Iterator {
   public:
    [[nodiscard]] JsonValue operator*() const noexcept {
      return {*tree_, at_ + (members_ ? 1 : 0)};
    }
    /// Of a member.
    [[nodiscard]] std::string_view key() const noexcept { return JsonValue(*tree_, at_).text(); }
    Iterator& operator++() noexcept;
    [[nodiscard]] bool operator==(const Iterator& other) const noexcept { return at_ == other.at_; }

   private:
    friend class JsonValue;
    Iterator(const JsonTree& tree, std::size_t at, bool members)
        : tree_(&tree), at_(at), members_(members) {}
    const JsonTree* tree_;
    std::size_t at_;
    bool members_;
  };
  [[nodiscard]] Iterator begin() const noexcept { return {*tree_, at_ + 1, is_object()}; }
  [[nodiscard]] Iterator end() const noexcept;
  /// The first element; there must be one.
  [[nodiscard]] JsonValue front() const noexcept { return *begin(); }
  /// A member of an object. O(members).
  [[nodiscard]] Iterator find(std::string_view key) const noexcept;
  [[nodiscard]] bool contains(std::string_view key) const noexcept { return find(key) != end(); }

 private:
  friend class JsonTree;
  JsonValue(const JsonTree& tree, std::size_t at) : tree_(&tree), at_(at) {}
  const JsonTree* tree_;
  std::size_t at_;
};

/// Built value after value, as a parser tells them.
class JsonTree {
 public:
  /// @param bytes  Of the text: a small one's nodes are made room for at once.
  void expect(std::size_t bytes) {
    constexpr std::size_t small = 1024;
    nodes_.reserve(std::min(bytes, small) / 2);
    open_.reserve(8);
    texts_.reserve(std::min(bytes, small) / 4);
  }
  [[nodiscard]] JsonValue root() const noexcept { return {*this, 0}; }
  [[nodiscard]] bool empty() const noexcept { return nodes_.empty(); }

  void put(JsonType scalar, double number = 0.0) {
    count();
    nodes_.push_back({scalar, nodes_.size() + 1, 0, number, 0});
  }
  /// @param key  Whether it names the member that follows.
  void put_text(std::string_view text, bool key = false) {
    if (!key) {
      count();
    }
    nodes_.push_back({JsonType::string, nodes_.size() + 1, text.size(), 0.0, texts_.size()});
    texts_ += text;
  }
  void open(JsonType type) {
    count();
    open_.push_back(nodes_.size());
    nodes_.push_back({type, 0, 0, 0.0, 0});
  }
  void close() {
    nodes_[open_.back()].next = nodes_.size();
    open_.pop_back();
  }
  [[nodiscard]] std::size_t depth() const noexcept { return open_.size(); }

 private:
  friend class JsonValue;
  friend class JsonValue::Iterator;
  struct Node {
    JsonType type;
    std::size_t next;  ///< The node behind it and all it holds.
    std::size_t size;  ///< Of what it holds, or of its text.
    double number;
    std::size_t text;  ///< Where it begins in `texts_`.
  };
  void count() {
    if (!open_.empty()) {
      ++nodes_[open_.back()].size;
    }
  }

  std::vector<Node> nodes_;
  std::vector<std::size_t> open_;
  std::string texts_;
};

inline JsonType JsonValue::type() const noexcept {
  return tree_->nodes_[at_].type;
}

inline double JsonValue::number() const noexcept {
  return tree_->nodes_[at_].number;
}

inline std::string_view JsonValue::text() const noexcept {
  const JsonTree::Node& node = tree_->nodes_[at_];
  return std::string_view(tree_->texts_).substr(node.text, node.size);
}

inline std::size_t JsonValue::size() const noexcept {
  return is_structured() ? tree_->nodes_[at_].size : 0;
}

inline JsonValue::Iterator& JsonValue::Iterator::operator++() noexcept {
  at_ = tree_->nodes_[at_ + (members_ ? 1 : 0)].next;
  return *this;
}

inline JsonValue::Iterator JsonValue::end() const noexcept {
  return {*tree_, is_structured() ? tree_->nodes_[at_].next : at_ + 1, is_object()};
}

inline JsonValue::Iterator JsonValue::find(std::string_view key) const noexcept {
  const Iterator last = end();
  Iterator member = begin();
  while (member != last && member.key() != key) {
    ++member;
  }
  return member;
}

}  // namespace flyball::solve
