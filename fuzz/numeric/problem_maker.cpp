#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "numeric/problem_maker.hpp"

namespace flyball::fuzz {

using Eigen::Index;
using Eigen::MatrixXd;
using nlohmann::json;
using solve::Absent;
using solve::Field;
using solve::FieldType;

namespace {

class Maker {
 public:
  explicit Maker(Choices& choices) : choices_(choices), mood_(choices.below(4)) {
    for (Index& size : sizes_) {
      size = choices.once_in(64) ? 0 : 1 + static_cast<Index>(choices.below(4));
      if (choices.once_in(6)) {
        size = 1 + static_cast<Index>(choices.below(8));
      }
    }
  }

  /// @param all, none  Optional fields that are there, or not.
  json object(std::span<const Field> fields, std::span<const std::string_view> all = {},
              std::span<const std::string_view> none = {}) {
    const auto is_of = [](std::span<const std::string_view> names, const Field& field) {
      return std::find(names.begin(), names.end(), field.name) != names.end();
    };
    std::vector<const Field*> there;
    for (const Field& field : fields) {
      if (is_of(none, field)) {
        continue;
      }
      if (is_of(all, field) || field.absent == Absent::refused || choices_.below(2) == 1) {
        there.push_back(&field);
      } else if (field.absent == Absent::identity && field.rows.size() == 1) {
        size(field.rows) = size_of(field.columns);
      }
    }
    json made = json::object();
    for (const Field* field : there) {
      made[std::string(field->name)] = value(*field);
    }
    const auto find = [&](std::string_view name) {
      return std::find_if(fields.begin(), fields.end(),
                          [&](const Field& field) { return field.name == name; });
    };
    // An expression, or num and den; seldom both or neither.
    if (const auto expr = find("expr"); expr != fields.end() && !choices_.once_in(12)) {
      const bool by_text = choices_.below(3) == 0;
      for (const std::string_view name : {"num", "den", "expr"}) {
        if ((name == "expr") != by_text) {
          made.erase(std::string(name));
        } else if (!made.contains(name)) {
          made[std::string(name)] = value(*find(name));
        }
      }
    }
    return made;
  }

 private:
  Index& size(std::string_view letter) { return sizes_[static_cast<std::size_t>(letter.front())]; }
  /// "n", "1", "n+p".
  Index size_of(std::string_view text) {
    Index sum = 0;
    for (const char c : text) {
      if (c >= '0' && c <= '9') {
        sum += c - '0';
      } else if (c != '+') {
        sum += size({&c, 1});
      }
    }
    return sum;
  }

  /// An entry: of the mildest mood a small number, of the wildest anything finite.
  double entry() {
    static constexpr std::array palette{
        0.0,      1.0,     -1.0,     2.0,     0.5,    -3.0,   0.0,     1.0,      // mild
        2.2e-16,  1e-8,    -1e-16,   1e20,    -1e20,  1e-20,  -1e-20,  1e8,      // wide
        5e-324,   1e-310,  2.3e-308, 1e154,   -1e154, 1e-154, -1e-154, 1.7e308,  // wild
        -1.7e308, -5e-324, 1e300,    -1e-300, 1e155,  1e-155, 1e100,   -1e-100};
    const std::size_t reach = mood_ < 2 ? 8 : mood_ == 2 ? 16 : palette.size();
    // Half of the entries are no palette's: sums of palette numbers cancel all too well.
    return choices_.below(2) == 0 ? palette[choices_.below(reach)] : 2.0 * choices_.fraction();
  }

  MatrixXd entries(Index rows, Index columns) {
    return MatrixXd::NullaryExpr(rows, columns, [this] { return entry(); });
  }

  /// D⁻¹ M D where its numbers stay finite.
  MatrixXd in_other_units(const MatrixXd& M) {
    const int most = mood_ < 2 ? 6 : mood_ == 2 ? 30 : 200;
    const Index longest = std::max(M.rows(), M.cols());
    Eigen::VectorXi power(longest);
    for (int& p : power) {
      p = static_cast<int>(std::lround(choices_.fraction() * most));
    }
    MatrixXd scaled = M;
    for (Index j = 0; j < M.cols(); ++j) {
      for (Index i = 0; i < M.rows(); ++i) {
        scaled(i, j) *= std::pow(10.0, power(i) - power(j));
      }
    }
    return scaled.allFinite() ? scaled : M;
  }

  MatrixXd matrix(Index rows, Index columns) {
    MatrixXd M = MatrixXd::Zero(rows, columns);
    if (M.size() == 0) {
      return M;
    }
    switch (choices_.below(12)) {
      case 0:  // zero but for a few
        M(static_cast<Index>(choices_.below(static_cast<std::size_t>(rows))),
          static_cast<Index>(choices_.below(static_cast<std::size_t>(columns)))) = entry();
        break;
      case 1:  // one number on the diagonal
        M.diagonal().setConstant(entry());
        break;
      case 2:
        for (double& d : M.diagonal()) {
          d = entry();
        }
        break;
      case 3:  // companion
        M.diagonal(columns > 1 ? 1 : 0).setOnes();
        M.row(rows - 1) = entries(1, columns);
        break;
      case 4:  // defective: one block, its eigenvalue, what couples
        M.diagonal().setConstant(entry());
        if (columns > 1) {
          M.diagonal(1).setConstant(entry());
        }
        break;
      case 5:  // repeated rows
        M = entries(1, columns).replicate(rows, 1);
        break;
      case 6:  // rank one
        M = entries(rows, 1) * entries(1, columns);
        break;
      case 7:
        M = entries(rows, columns).triangularView<Eigen::Upper>();
        break;
      case 8:  // a stable one, or one that holds
        M = entries(rows, columns);
        M.diagonal().array() -= choices_.one_of({0.0, 1.0, 3.0, 10.0});
        break;
      case 9:
        M = in_other_units(entries(rows, columns));
        break;
      case 10:  // a chain that feeds back, weakly as a rule
        if (rows > 1) {
          M.diagonal(-1).setConstant(entry());
        }
        M(0, columns - 1) = entry();
        break;
      default:
        M = entries(rows, columns);
        break;
    }
    return M.allFinite() ? M : MatrixXd::Zero(rows, columns).eval();
  }

  MatrixXd symmetric(Index n) {
    MatrixXd M = matrix(n, n);
    switch (choices_.below(8)) {
      case 0:  // not symmetric
        return M;
      case 1:  // indefinite
        M.triangularView<Eigen::StrictlyUpper>() = M.transpose();
        return M;
      case 2:
      case 3:
        return MatrixXd::Identity(n, n) * std::abs(entry());
      case 4:
        M = M.diagonal().cwiseAbs().asDiagonal().toDenseMatrix().eval();
        return M;
      default: {
        const MatrixXd square = M * M.transpose();
        MatrixXd whole = square;
        whole.triangularView<Eigen::StrictlyUpper>() = square.transpose();
        return whole.allFinite() ? whole : MatrixXd::Identity(n, n).eval();
      }
    }
  }

  double number(std::string_view name) {
    if (choices_.once_in(24)) {
      return entry();
    }
    if (name == "power") {
      return choices_.one_of({0.5, 2.0, -1.0, 3.0, 0.25, -0.5, 0.3, 1e-3, 17.0, 1e20});
    }
    if (name == "tolerance") {
      return choices_.one_of({0.0, 1e-10, 1e-3, 1.0});
    }
    if (mood_ < 2) {
      return choices_.one_of({0.02, 1.0, 0.1, 0.5, 2.0, 0.03});
    }
    return choices_.one_of({0.02, 1.0, 1e-6, 1e6, 1e-3, 1e-300, 1e300, 5e-324, 100.0});
  }

  /// A transfer function in words, of s, seldom of z.
  std::string expression(int depth) {
    const auto operand = [&] { return "(" + expression(depth - 1) + ")"; };
    if (depth > 0) {
      switch (choices_.below(7)) {
        case 0:
          return operand() + "+" + operand();
        case 1:
          return operand() + "-" + operand();
        case 2:
          return operand() + "*" + operand();
        case 3:
          return operand() + "/" + operand();
        case 4:
          return "feedback(" + expression(depth - 1) + "," + expression(depth - 1) + ")";
        case 5:
          return operand() + "^" + std::to_string(choices_.below(4));
        default:
          break;
      }
    }
    const std::string one = std::to_string(entry());
    const std::string other = std::to_string(entry());
    switch (choices_.below(6)) {
      case 0:
        return "s";
      case 1:
        return "exp(-" + std::to_string(std::abs(entry())) + "*s)";
      case 2:
        return "[" + one + " " + other + "]/[1 " + one + " 2]";
      case 3:
        return choices_.once_in(8) ? "z" : one;
      default:
        return "(" + other + ")/(s+" + "(" + one + "))";
    }
  }

  double integer() {
    if (choices_.once_in(40)) {
      return choices_.one_of({-1.0, 1e9, 1e6, 0.0, -1e9});
    }
    return static_cast<double>(choices_.below(9));
  }

  json rows_of(const MatrixXd& M) {
    json rows = json::array();
    for (Index i = 0; i < M.rows(); ++i) {
      rows.push_back(json(std::vector<double>(M.row(i).begin(), M.row(i).end())));
    }
    return rows;
  }

  json list(const Field& field) {
    std::vector<double> values(static_cast<std::size_t>(size_of(field.rows)));
    double sum = 0.0;
    for (double& value : values) {
      if (field.name == "pairs") {
        value = static_cast<double>(choices_.below(4));
      } else if (field.name == "times") {
        value = sum += choices_.once_in(16) ? entry() : std::abs(choices_.fraction());
      } else {
        value = entry();
      }
    }
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })
               ? json(values)
               : json(std::vector<double>(values.size(), 1.0));
  }

  /// Real numbers and conjugate pairs.
  json complex_list(Index count) {
    json made = json::array();
    const double sign = choices_.below(2) == 0 ? -1.0 : 1.0;
    const double repeated = std::abs(entry());
    while (static_cast<Index>(made.size()) < count) {
      const double re = choices_.once_in(4) ? repeated : std::abs(entry());
      if (static_cast<Index>(made.size()) + 2 <= count && choices_.below(3) == 0) {
        const double im = entry();
        made.push_back({sign * re, im});
        made.push_back({sign * re, choices_.once_in(32) ? im : -im});
      } else {
        made.push_back(sign * re);
      }
    }
    return made;
  }

  /// Uncertain blocks that share out m inputs and p outputs.
  json blocks() {
    Index inputs = size("m");
    Index outputs = size("p");
    json made = json::array();
    while (inputs > 0 && outputs > 0) {
      const bool last = made.size() >= 5 || choices_.once_in(5);
      const Index k = 1 + static_cast<Index>(
                              choices_.below(static_cast<std::size_t>(std::min(inputs, outputs))));
      if (last || (choices_.below(3) == 0 && inputs != outputs)) {
        made.push_back("full " + std::to_string(inputs) + "x" + std::to_string(outputs));
        return made;
      }
      // A full block with less of the one side evens them out.
      const Index rows = inputs > outputs ? inputs - outputs + k : k;
      const Index columns = outputs > inputs ? outputs - inputs + k : k;
      if (rows != columns || choices_.below(3) == 0) {
        made.push_back("full " + std::to_string(rows) + "x" + std::to_string(columns));
        inputs -= rows;
        outputs -= columns;
        continue;
      }
      made.push_back((choices_.below(2) == 0 ? "real " : "complex ") + std::to_string(k));
      inputs -= k;
      outputs -= k;
    }
    return made;
  }

  json value(const Field& field) {
    switch (field.type) {
      case FieldType::number:
        return number(field.name);
      case FieldType::integer:
        return integer();
      case FieldType::choice: {
        std::vector<std::string_view> choices;
        std::string_view rest = field.choices;
        for (std::size_t space = rest.find(' '); space != rest.npos; space = rest.find(' ')) {
          choices.push_back(rest.substr(0, space));
          rest.remove_prefix(space + 1);
        }
        choices.push_back(rest);
        return std::string(choices[choices_.below(choices.size())]);
      }
      case FieldType::samples:
      case FieldType::matrix: {
        const Index rows = size_of(field.rows);
        const bool weight = field.rows == field.columns &&
                            (field.name[0] == 'Q' || field.name[0] == 'R' || field.name[0] == 'S');
        return rows_of(weight ? symmetric(rows) : matrix(rows, size_of(field.columns)));
      }
      case FieldType::list:
        return list(field);
      case FieldType::complex_list:
        return complex_list(size_of(field.rows));
      case FieldType::system: {
        const Index n = size_of(field.rows);
        const Index m = size_of(field.columns);
        const Index p = size_of(field.outputs);
        return {{"A", rows_of(matrix(n, n))},
                {"B", rows_of(matrix(n, m))},
                {"C", rows_of(matrix(p, n))},
                {"D", rows_of(matrix(p, m))}};
      }
      case FieldType::text:
        return expression(3);
      case FieldType::transfers: {
        json rows = json::array();
        const Index columns = size_of(field.columns);
        for (Index i = 0; i < size_of(field.rows); ++i) {
          rows.push_back(json::array());
          for (Index j = 0; j < columns; ++j) {
            rows.back().push_back(expression(1));
          }
        }
        return rows;
      }
      case FieldType::objects: {
        json all = json::array();
        for (std::size_t i = choices_.below(4); i > 0; --i) {
          all.push_back(object(*field.inner));
        }
        return all;
      }
      case FieldType::transfer:
        if (choices_.once_in(4)) {
          return expression(2);
        }
        return {{"num", rows_of(matrix(1, size_of(field.rows)))[0]},
                {"den", rows_of(matrix(1, size_of(field.columns)))[0]}};
      case FieldType::texts:
        if (field.name == "blocks") {
          return blocks();
        }
        return json(std::vector<std::string>(static_cast<std::size_t>(size_of(field.rows)), "x"));
      default:
        return nullptr;
    }
  }

  Choices& choices_;
  std::size_t mood_;
  std::array<Index, 128> sizes_{};
};

}  // namespace

namespace {

/// A motion along a curve: limits of its coordinates are there and positive, those of the way are
/// positive, most of the time; what is asked of others is that they are refused.
json timing_problem(const solve::Kind& kind, Choices& choices) {
  static constexpr std::string_view coordinates[] = {"velocity", "acceleration"};
  static constexpr std::string_view of_coordinates[] = {"velocity", "acceleration", "jerk"};
  static constexpr std::string_view ends[] = {"start_velocity", "end_velocity", "slow",
                                              "tolerance"};
  static constexpr std::string_view of_the_way[] = {"travel_velocity",  "travel_acceleration",
                                                    "centripetal",      "total_acceleration",
                                                    "angular_velocity", "angular_acceleration",
                                                    "travel_jerk",      "start_velocity",
                                                    "end_velocity",     "tolerance"};
  if (choices.once_in(8)) {
    return Maker(choices).object(kind.fields);
  }
  const bool at_rest = choices.below(3) > 0;
  json made = at_rest ? Maker(choices).object(kind.fields, coordinates, ends)
                      : Maker(choices).object(kind.fields, coordinates);
  const auto positive = [](const json& value) {
    const double size = std::abs(value.get<double>());
    return size > 0.0 ? size : 1.0;
  };
  for (const std::string_view name : of_coordinates) {
    if (const auto limits = made.find(name); limits != made.end()) {
      for (json& limit : *limits) {
        limit = positive(limit);
      }
    }
  }
  for (const std::string_view name : of_the_way) {
    if (const auto limit = made.find(name); limit != made.end()) {
      *limit = positive(*limit);
    }
  }
  made["samples"] = choices.one_of({2, 11, 51, 101, 201});
  return made;
}

}  // namespace

json make_problem(const solve::Kind& kind, Choices& choices) {
  if (kind.name == "path-parameterization") {
    return timing_problem(kind, choices);
  }
  if (kind.name == "mu") {
    static constexpr std::string_view constant[] = {"M"};
    static constexpr std::string_view parts[] = {"M", "M_imag"};
    static constexpr std::string_view system[] = {"A", "B", "C"};
    static constexpr std::string_view matrices[] = {"A", "B", "C", "D"};
    return choices.below(3) == 0 ? Maker(choices).object(kind.fields, system, parts)
                                 : Maker(choices).object(kind.fields, constant, matrices);
  }
  return Maker(choices).object(kind.fields);
}

}  // namespace flyball::fuzz
