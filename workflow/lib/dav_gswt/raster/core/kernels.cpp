// This instruction set's table.
#include "kernels.h"

namespace raster {
namespace ISA {

extern const Kernels table;
const Kernels table = {ISA_NAME,         project,    load_colours,          blend_forward, blend_backward, collect,
                       project_backward, contribute, collect_contributions, loss,          adam};

}  // namespace ISA
}  // namespace raster
