// This instruction set's table.
#include "kernels.h"

namespace raster {
namespace ISA {

extern const Kernels table = {ISA_NAME,
                              cull,
                              project,
                              load_values,
                              find_blocks,
                              blend_forward,
                              blend_backward,
                              collect,
                              project_backward,
                              contribute,
                              collect_contributions,
                              count_pairs,
                              loss,
                              adam,
                              peak};

}  // namespace ISA
}  // namespace raster
