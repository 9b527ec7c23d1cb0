! SPDX-License-Identifier: MIT
!> The point to which the coordinates of a run are relative.
!>
!> Positions of a model that lies far from (0, 0), as map coordinates do, have few digits for the motion of the blocks:
!> at 5e5 m their rounding is 6e-11 m, which contact springs turn into forces. A run therefore subtracts a datum, and
!> its results add it again. It is 0 for models near (0, 0). Otherwise it is a whole multiple of a power of two that is
!> larger than the model: the difference then has no rounding.
module rockdda_model_datum
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type, point_set_type
   implicit none
   private
   public :: find_datum, move_model

   !> Ratio of its distance from 0 to its extent at which a model lies far away.
   real(wp), parameter :: far = 16.0_wp

contains

   !> The datum of a model.
   pure function find_datum(blocks) result(datum)
      type(block_system_type), intent(in) :: blocks
      real(wp) :: datum(2)                 !! [length]
      real(wp) :: low(2), high(2), extent, unit
      integer :: axis
      datum = 0
      if (blocks%n_vertices() == 0) return
      low = minval(blocks%vertices, dim=2)
      high = maxval(blocks%vertices, dim=2)
      extent = maxval(high - low)
      if (.not. (extent > 0 .and. extent < huge(extent))) return
      unit = 2.0_wp**exponent(extent)
      do axis = 1, 2
         if (min(abs(low(axis)), abs(high(axis))) > far*extent .and. low(axis)*high(axis) > 0) &
            datum(axis) = unit*anint(low(axis)/unit)
      end do
   end function find_datum

   !> Move a model with its points and bolts.
   pure subroutine move_model(by, blocks)
      real(wp), intent(in) :: by(2)        !! [length]
      type(block_system_type), intent(inout) :: blocks
      integer :: axis
      if (.not. any(abs(by) > 0)) return
      do axis = 1, 2
         blocks%vertices(axis, :) = blocks%vertices(axis, :) + by(axis)
         call move_points(blocks%fixed)
         call move_points(blocks%loading)
         call move_points(blocks%measured)
         if (blocks%bolts%n == 0) cycle
         blocks%bolts%ends(axis, :) = blocks%bolts%ends(axis, :) + by(axis)
         blocks%bolts%ends(axis + 2, :) = blocks%bolts%ends(axis + 2, :) + by(axis)
      end do

   contains

      !> Move points along the axis.
      pure subroutine move_points(points)
         type(point_set_type), intent(inout) :: points
         if (points%n > 0) points%position(axis, :) = points%position(axis, :) + by(axis)
      end subroutine move_points

   end subroutine move_model

end module rockdda_model_datum
