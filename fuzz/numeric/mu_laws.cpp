#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "numeric/mu_laws.hpp"
#include "numeric/quad.hpp"

namespace flyball::fuzz {

using nlohmann::json;

namespace {

constexpr double never = std::numeric_limits<double>::infinity();

/// A complex matrix.
struct Pair {
  QuadMatrix re, im;
};

Pair pair_of(const json& object, const std::string& name) {
  QuadMatrix re = quad_matrix(object.at(name));
  QuadMatrix im = object.contains(name + "_imag") ? quad_matrix(object.at(name + "_imag"))
                                                  : QuadMatrix(re.rows(), re.columns());
  return {std::move(re), std::move(im)};
}
Pair operator*(const Pair& a, const Pair& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
Pair operator-(const Pair& a, const Pair& b) {
  return {a.re - b.re, a.im - b.im};
}
Pair adjoint(const Pair& a) {
  return {transpose(a.re), Quad(-1) * transpose(a.im)};
}
Pair operator*(Quad a, const Pair& b) {
  return {a * b.re, a * b.im};
}
/// [re -im; im re].
QuadMatrix doubled(const Pair& a) {
  QuadMatrix both(2 * a.re.rows(), 2 * a.re.columns());
  put(both, 0, 0, a.re);
  put(both, 0, a.re.columns(), Quad(-1) * a.im);
  put(both, a.re.rows(), 0, a.im);
  put(both, a.re.rows(), a.re.columns(), a.re);
  return both;
}

/// All pivots of elimination are positive.
bool is_positive(QuadMatrix S) {
  const int n = S.rows();
  for (int k = 0; k < n; ++k) {
    if (!(S(k, k) > 0)) {
      return false;
    }
    for (int i = k + 1; i < n; ++i) {
      const Quad factor = S(i, k) / S(k, k);
      for (int c = k; c < n; ++c) {
        S(i, c) -= factor * S(k, c);
      }
    }
  }
  return true;
}

/// diag(left) a diag(right)⁻¹.
Pair scaled(Pair a, const std::vector<double>& left, const std::vector<double>& right) {
  for (QuadMatrix* part : {&a.re, &a.im}) {
    for (int i = 0; i < part->rows(); ++i) {
      for (int c = 0; c < part->columns(); ++c) {
        (*part)(i, c) *=
            Quad(left[static_cast<std::size_t>(i)]) / Quad(right[static_cast<std::size_t>(c)]);
      }
    }
  }
  return a;
}

/// Powers of two near the roots of the diagonal.
std::vector<double> roots_of(const Pair& D) {
  std::vector<double> roots;
  for (int i = 0; i < D.re.rows(); ++i) {
    const auto d = static_cast<double>(D.re(i, i));
    roots.push_back(d > 0.0 ? std::exp2(std::round(0.5 * std::log2(d))) : 1.0);
  }
  return roots;
}

double square_sum(const QuadMatrix& re, const QuadMatrix& im, Quad scale) {
  Quad sum = 0;
  for (const QuadMatrix* part : {&re, &im}) {
    for (const Quad entry : part->entries()) {
      sum += (entry / scale) * (entry / scale);
    }
  }
  return static_cast<double>(sum);
}

/// How far Δ's blocks are from what they must be, relative to 1/lower.
double structure_defect(const json& problem, Pair delta, double lower) {
  int in = 0;
  int out = 0;
  double worst = 0.0;
  const Quad size = Quad(1) / Quad(lower);
  for (const json& text : problem.at("blocks")) {
    const auto block_text = text.get<std::string>();
    int rows = 1;
    int columns = 1;
    const bool full = block_text.starts_with("full");
    if (full) {
      std::sscanf(block_text.c_str(), "full %dx%d", &rows, &columns);
    } else {
      const auto space = block_text.find(' ');
      rows = columns = space == std::string::npos ? 1 : std::stoi(block_text.substr(space));
    }
    const QuadMatrix re = block(delta.re, in, out, rows, columns);
    const QuadMatrix im = block(delta.im, in, out, rows, columns);
    const QuadMatrix one_re = full ? re : block(re, 0, 0, 1, 1);
    const QuadMatrix one_im = full ? im : block(im, 0, 0, 1, 1);
    worst = std::max(worst, std::sqrt(square_sum(one_re, one_im, size)) - 1.0);
    for (int i = 0; i < rows; ++i) {
      for (int c = 0; c < columns; ++c) {
        const bool must = full || i == c;
        const bool is_real = block_text.starts_with("real");
        if ((!must && (re(i, c) != 0 || im(i, c) != 0)) || (is_real && im(i, c) != 0) ||
            (must && !full && (re(i, c) != re(0, 0) || im(i, c) != im(0, 0)))) {
          worst = never;
        }
        delta.re(in + i, out + c) = 0;
        delta.im(in + i, out + c) = 0;
      }
    }
    in += rows;
    out += columns;
  }
  return delta.re.largest() > 0 || delta.im.largest() > 0 ? never : worst;
}

}  // namespace

std::vector<Verdict> mu_verdicts(const json& problem, const json& answer) {
  std::vector<Verdict> verdicts;
  const auto lower = answer.at("lower").get<double>();
  const auto upper = answer.at("upper").get<double>();
  verdicts.push_back({"lower <= upper", lower <= upper ? 0.0 : never});
  const Pair delta = pair_of(answer, "delta");
  if (lower > 0.0) {
    // What a lower bound gives away to its rounding, its Δ need not.
    verdicts.push_back({"delta", std::max(0.0, structure_defect(problem, delta, lower))});
  }
  if (!problem.contains("M")) {
    return verdicts;
  }
  const Pair M = pair_of(problem, "M");
  const Pair D_out = pair_of(answer, "D_out");
  const Pair D_in = pair_of(answer, "D_in");
  const Pair GM = pair_of(answer, "G") * M;
  // -j (X - Xᴴ) = (Im X + (Im X)ᵀ) - j (Re X - (Re X)ᵀ)
  const Pair turned = GM - adjoint(GM);
  Pair form = Quad(upper) * (Quad(upper) * D_in) - adjoint(M) * (D_out * M);
  form = form - Pair{Quad(-1) * turned.im, turned.re};
  const bool proven = is_positive(doubled(form)) && is_positive(doubled(D_out));
  const Quad largest = std::max(M.re.largest(), M.im.largest());
  if (largest > 0) {
    verdicts.push_back({"proof", proven ? 0.0 : never});
    const double norm = std::sqrt(square_sum(M.re, M.im, largest));
    const auto share = static_cast<double>(Quad(upper) / largest);
    constexpr double least_normal = std::numeric_limits<double>::min();
    if (largest > least_normal) {  // a bound below has no digits left
      verdicts.push_back({"below the norm", std::max(0.0, share / norm - 1.001)});
    }
  }
  if (lower > 0.0) {
    const std::vector<double> out = roots_of(D_out);
    const std::vector<double> in = roots_of(D_in);
    const Pair MD = scaled(M, out, in) * scaled(delta, in, out);
    const int p = M.re.rows();
    const Pair rest = Pair{QuadMatrix::identity(p), QuadMatrix(p, p)} - MD;
    const Quad size = 1 + std::max(MD.re.largest(), MD.im.largest());
    verdicts.push_back(
        {"singular", static_cast<double>(smallest_singular_value(doubled(rest)) / size)});
  }
  return verdicts;
}

}  // namespace flyball::fuzz
