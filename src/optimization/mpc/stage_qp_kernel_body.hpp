#pragma once

// The method for quadratic programs over stages, in the namespace FLYBALL_VARIANT.

namespace flyball::optimization::detail::FLYBALL_VARIANT {

namespace {

template <int Lanes>
struct PackOf;
template <>
struct PackOf<4> {
  using Pack = double __attribute__((vector_size(32), aligned(8), may_alias));
};
template <>
struct PackOf<8> {
  using Pack = double __attribute__((vector_size(64), aligned(8), may_alias));
};
using Pack4 = PackOf<4>::Pack;
using Pack8 = PackOf<8>::Pack;

inline double sum_of(const Pack4& t) {
  return (t[0] + t[2]) + (t[1] + t[3]);
}
inline double sum_of(const Pack8& t) {
  const Pack4 low = __builtin_shufflevector(t, t, 0, 1, 2, 3);
  const Pack4 high = __builtin_shufflevector(t, t, 4, 5, 6, 7);
  return sum_of(Pack4(low + high));
}

/// Rows of `Width` numbers, a multiple of the lanes of a pack; 0: of as many as the program says.
template <int Width>
struct QpRow {
  using Pack = typename PackOf<Width == 4 ? 4 : 8>::Pack;
  static constexpr int lanes = Width == 4 ? 4 : 8;
  static constexpr int count(int width) { return (Width > 0 ? Width : width) / lanes; }
  static const Pack* packs(const double* x) { return reinterpret_cast<const Pack*>(x); }
  static Pack* packs(double* x) { return reinterpret_cast<Pack*>(x); }

  static void zero(double* y, int width) {
    for (int i = 0; i < count(width); ++i) {
      packs(y)[i] = Pack{};
    }
  }
  static void copy(double* y, const double* x, int width) {
    for (int i = 0; i < count(width); ++i) {
      packs(y)[i] = packs(x)[i];
    }
  }
  /// y += a x
  static void add(double* y, double a, const double* x, int width) {
    for (int i = 0; i < count(width); ++i) {
      packs(y)[i] += a * packs(x)[i];
    }
  }
  static double dot(const double* x, const double* y, int width) {
    Pack sum = packs(x)[0] * packs(y)[0];
    for (int i = 1; i < count(width); ++i) {
      sum += packs(x)[i] * packs(y)[i];
    }
    return sum_of(sum);
  }
  /// Sums for `Rows` rows side by side, in registers where the width is known.
  template <int Rows>
  struct Block {
    static constexpr int most = Width > 0 ? Width / lanes : 1;
    Pack sums[Rows][most];
    double* to = nullptr;
    int row_width = Width;
    void load(double* out, const double* from, int width) {
      to = out;
      row_width = width;
      for (int r = 0; r < Rows; ++r) {
        for (int i = 0; i < count(width); ++i) {
          const Pack pack = from == nullptr ? Pack{} : packs(from + r * width)[i];
          if constexpr (Width > 0) {
            sums[r][i] = pack;
          } else {
            packs(out + r * width)[i] = pack;
          }
        }
      }
    }
    void add(const double* a, int by_row, const double* x) {
      for (int i = 0; i < count(row_width); ++i) {
        const Pack pack = packs(x)[i];
        for (int r = 0; r < Rows; ++r) {
          if constexpr (Width > 0) {
            sums[r][i] += a[r * by_row] * pack;
          } else {
            packs(to + r * row_width)[i] += a[r * by_row] * pack;
          }
        }
      }
    }
    void store() {
      for (int r = 0; r < Rows && Width > 0; ++r) {
        for (int i = 0; i < most; ++i) {
          packs(to + r * row_width)[i] = sums[r][i];
        }
      }
    }
  };
};

#include "optimization/mpc/stage_qp_method.inc"

template <class Work>
auto with_sizes(StageQp& qp, Work&& work) {
  const auto is = [&](int states, int inputs) {
    return qp.states == states && qp.inputs == inputs;
  };
  if (is(5, 2)) {
    return work(StageQpMethod<5, 2, 8>(qp));
  }
  if (is(12, 4)) {
    return work(StageQpMethod<12, 4, 16>(qp));
  }
  switch (qp.width) {
    case 4:
      return work(StageQpMethod<0, 0, 4>(qp));
    case 8:
      return work(StageQpMethod<0, 0, 8>(qp));
    case 16:
      return work(StageQpMethod<0, 0, 16>(qp));
    default:
      return work(StageQpMethod<0, 0, 0>(qp));
  }
}

}  // namespace

QpEnd solve_stage_qp(StageQp& qp) noexcept {
  return with_sizes(qp, [](auto&& method) { return method.solve(); });
}

bool factor_stage_qp(StageQp& qp) noexcept {
  return with_sizes(qp, [](auto&& method) {
    method.top = method.N;
    method.begin_at_end(method.s.h);
    return method.factor(method.N - 1, false);
  });
}

void sweep_stage_qp(StageQp& qp) noexcept {
  with_sizes(qp, [](auto&& method) {
    method.top = method.N;
    method.begin_at_end(method.s.h);
    method.sweep(method.N - 1, method.s.h, false);
  });
}

}  // namespace flyball::optimization::detail::FLYBALL_VARIANT
