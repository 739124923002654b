#include <algorithm>
#include <charconv>
#include <cmath>

#include <flyball/core/text.hpp>

#include "control/robust/uncertainty.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

using Eigen::Index;

namespace {

/// "3", a size.
bool read_size(std::string_view text, Index& size) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), size);
  return error == std::errc() && end == text.data() + text.size() && size > 0;
}

}  // namespace

Expected<UncertaintyBlock> parse_uncertainty_block(std::string_view text) {
  const auto space = text.find(' ');
  const std::string_view kind = text.substr(0, space);
  const std::string_view sizes = space == text.npos ? std::string_view() : text.substr(space + 1);
  UncertaintyBlock block;
  bool good = kind == "real" || kind == "complex" || kind == "full";
  block.kind = kind == "real"   ? UncertaintyKind::real
               : kind == "full" ? UncertaintyKind::full
                                : UncertaintyKind::complex;
  if (good && kind == "full") {
    const auto by = sizes.find('x');
    good = by != sizes.npos && read_size(sizes.substr(0, by), block.rows) &&
           read_size(sizes.substr(by + 1), block.columns);
  } else if (good && space != text.npos) {
    good = read_size(sizes, block.rows);
  }
  if (!good) {
    return refusal(ArgumentError::malformed, "parse_uncertainty_block", "a block")
        .got("\"" + std::string(text) + "\"")
        .expected("\"real\", \"real 3\", \"complex\", \"complex 3\" or \"full 2x3\"");
  }
  if (block.kind != UncertaintyKind::full) {
    block.columns = block.rows;
  }
  return block;
}

namespace detail {

bool UncertaintyStructure::has_real() const {
  return std::any_of(blocks.begin(), blocks.end(),
                     [](const BlockSpan& block) { return block.is_real(); });
}

Expected<UncertaintyStructure> structure_of(const std::vector<UncertaintyBlock>& blocks,
                                            Index outputs, Index inputs, std::string_view where) {
  if (blocks.empty()) {
    return refusal(ArgumentError::empty, where, "blocks").expected("one block at least");
  }
  if (std::max(outputs, inputs) > most_structured_size) {
    return refusal(ArgumentError::out_of_range, where, "M")
        .got(format("{}x{}", outputs, inputs))
        .expected(format("at most {} inputs and outputs", most_structured_size));
  }
  UncertaintyStructure structure;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const UncertaintyBlock& block = blocks[i];
    const bool full = block.kind == UncertaintyKind::full;
    const Index columns = full ? block.columns : block.rows;
    // A size beyond M's would overflow the sums.
    if (block.rows < 1 || columns < 1 || block.rows > inputs || columns > outputs) {
      return refusal(ArgumentError::wrong_shape, where,
                     format("block {} of {}", i + 1, blocks.size()))
          .got(format("{}x{}", block.rows, columns))
          .expected(format("rows from 1 to M's {} inputs, columns from 1 to its {} outputs", inputs,
                           outputs));
    }
    const bool scalar = full && block.rows == 1 && columns == 1;
    structure.blocks.push_back({scalar ? UncertaintyKind::complex : block.kind, structure.inputs,
                                block.rows, structure.outputs, columns});
    structure.inputs += block.rows;
    structure.outputs += columns;
  }
  if (structure.inputs != inputs || structure.outputs != outputs) {
    return refusal(ArgumentError::wrong_shape, where, "the structure")
        .got(format("of {} inputs and {} outputs", structure.inputs, structure.outputs))
        .expected(format("of {} and {}, M's", inputs, outputs));
  }
  return structure;
}

namespace {

/// Rows and columns of M that share a scale.
struct Group {
  Index in, rows, out, columns;
};

std::vector<Group> groups_of(const UncertaintyStructure& structure) {
  std::vector<Group> groups;
  for (const BlockSpan& block : structure.blocks) {
    if (block.is_full()) {
      groups.push_back({block.in, block.rows, block.out, block.columns});
      continue;
    }
    for (Index k = 0; k < block.rows; ++k) {
      groups.push_back({block.in + k, 1, block.out + k, 1});
    }
  }
  return groups;
}

std::complex<double> scaled(std::complex<double> x, int power) {
  return {std::ldexp(x.real(), power), std::ldexp(x.imag(), power)};
}

}  // namespace

BalancedMatrix balanced(const Eigen::MatrixXcd& M, const UncertaintyStructure& structure) {
  BalancedMatrix result{M, Eigen::VectorXi::Zero(M.cols()), Eigen::VectorXi::Zero(M.rows()), 0};
  const auto largest = [](const auto& block) {
    return std::max(block.real().cwiseAbs().maxCoeff(), block.imag().cwiseAbs().maxCoeff());
  };
  const double first = largest(M);
  if (first == 0.0) {
    return result;
  }
  // Logarithms of the groups' blocks: no number overflows.
  const std::vector<Group> groups = groups_of(structure);
  const auto count = static_cast<Index>(groups.size());
  constexpr double nothing = -1e4;
  Eigen::MatrixXd sizes(count, count);
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < count; ++j) {
      const Group& to = groups[static_cast<std::size_t>(i)];
      const Group& from = groups[static_cast<std::size_t>(j)];
      const double size = largest(M.block(to.out, from.in, to.columns, from.rows));
      sizes(i, j) = size > 0.0 ? std::log2(size) : nothing;
    }
  }
  constexpr int most = 200;
  constexpr double far = 60.0;  // Below the largest: what is there no longer counts.
  Eigen::VectorXi d = Eigen::VectorXi::Zero(count);
  const auto top = [&] {
    double found = nothing;
    for (Index i = 0; i < count; ++i) {
      for (Index j = 0; j < count; ++j) {
        found = std::max(found, sizes(i, j) + d(i) - d(j));
      }
    }
    return found;
  };
  double overall = top();
  for (int sweep = 0; sweep < 60; ++sweep) {
    bool moved = false;
    for (Index i = 0; i < count; ++i) {
      double row = overall - far;
      double column = overall - far;
      for (Index j = 0; j < count; ++j) {
        if (j != i) {
          row = std::max(row, sizes(i, j) + d(i) - d(j));
          column = std::max(column, sizes(j, i) + d(j) - d(i));
        }
      }
      const int step = static_cast<int>(std::lround(0.5 * (column - row)));
      const int to = std::clamp(d(i) + step, -most, most);
      moved = moved || to != d(i);
      d(i) = to;
    }
    // What is the largest now may be what did not count before.
    const double now = top();
    if (!moved && now > overall - 1.0) {
      break;
    }
    overall = moved ? overall : now;
  }
  for (Index i = 0; i < count; ++i) {
    const Group& group = groups[static_cast<std::size_t>(i)];
    result.in.segment(group.in, group.rows).setConstant(d(i));
    result.out.segment(group.out, group.columns).setConstant(d(i));
  }
  result.size = static_cast<int>(std::ceil(top()));
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      result.M(i, j) = scaled(M(i, j), result.out(i) - result.in(j)-result.size);
    }
  }
  return result;
}

double balanced_size(const Eigen::MatrixXcd& M, const UncertaintyStructure& structure) {
  const BalancedMatrix balance = balanced(M, structure);
  return std::ldexp(balance.M.norm(), balance.size);
}

}  // namespace detail
}  // namespace flyball
