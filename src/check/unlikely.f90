! SPDX-License-Identifier: MIT
!> What a model has that hardly can be meant: splinters (blocks far thinner than the others, as joints that nearly
!> coincide cut them off), a surcharge that no traction carries, a reset of nothing, water far above.
module rockdda_check_unlikely
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity, origin_type
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_water_check, only : title_of
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_geometry_polygons, only : inradius_bound, polygon_properties
   implicit none
   private
   public :: check_ground

   !> A splinter is thinner than this share of the side of a square of the mean area.
   real(wp), parameter :: thin = 0.0025_wp
   !> Largest number of splinters named in the summary.
   integer, parameter :: most_named = 3

   !> Tractions that differ from the stress under the surface by less are rounded.
   real(wp), parameter :: rounding = 0.02_wp
   !> Heights of the model by which water may stand above it.
   real(wp), parameter :: most_heights = 2

contains

   !> All of them.
   subroutine check_ground(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      call check_splinters(blocks, parameters%units, messages)
      call check_surcharge(blocks, parameters, messages)
      call check_first_reset(parameters, messages)
      call check_water_tables(blocks, parameters, messages)
   end subroutine check_ground

   !> Check that the stress that &in_situ gives at the top of the model is that of the pressures along it: else the
   !> first stage moves the blocks until both fit.
   subroutine check_surcharge(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: top, weight, expected, found, tolerance
      integer :: g, k
      if (.not. (allocated(parameters%in_situ) .and. allocated(parameters%boundaries))) return
      top = maxval(blocks%vertices(2, :))
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      found = 0
      do k = 1, size(parameters%boundaries)
         associate (b => parameters%boundaries(k))
            if (.not. allocated(b%along)) cycle
            if (any(abs(b%along(2, :) - top) > tolerance)) cycle
            ! what holds the top carries any stress; other tractions are left to the user
            if (b%kind /= 'traction' .or. .not. is_set(b%pressure)) return
            if (allocated(b%table)) then
               if (size(b%table, 2) > 0) return
            end if
            found = found + b%pressure
         end associate
      end do
      do g = 1, size(parameters%in_situ)
         associate (s => parameters%in_situ(g))
            if (.not. is_set(s%surface) .or. is_given(s%region)) cycle
            if (s%surface < top - tolerance) cycle
            weight = 0
            if (is_set(s%unit_weight)) then
               weight = s%unit_weight
            else if (parameters%gravity >= 0) then
               weight = parameters%gravity*maxval(parameters%block_materials%density)
            end if
            expected = weight*max(0.0_wp, s%surface - top)
            if (is_set(s%surcharge)) expected = expected + s%surcharge
            if (abs(expected - found) <= rounding*max(abs(expected), abs(found))) cycle
            call messages%add(severity%warning, '&in_situ: surcharge and surface give a stress of '// &
                              parameters%shown(expected, 'stress')//' at the top of the model, y = '// &
                              parameters%shown(top, 'length', 6)// &
                              ', where boundaries press with '//parameters%shown(found, 'stress')// &
                              ': the blocks will move until both are equal; give &boundary along the top, '// &
                              "kind = 'traction', this pressure", &
                              s%origin)
         end associate
      end do
   end subroutine check_surcharge

   !> Check that water does not stand far above a model, unless rock does: stress in the ground, or a load on the top.
   subroutine check_water_tables(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: top, above, height
      integer :: g
      if (.not. allocated(parameters%water)) return
      if (allocated(parameters%in_situ)) then
         if (size(parameters%in_situ) > 0) return
      end if
      if (allocated(parameters%boundaries)) then
         if (any([(parameters%boundaries(g)%kind == 'traction', g=1, size(parameters%boundaries))])) return
      end if
      top = maxval(blocks%vertices(2, :))
      height = top - minval(blocks%vertices(2, :))
      do g = 1, size(parameters%water)
         associate (water => parameters%water(g))
            if (.not. allocated(water%table)) cycle
            above = maxval(water%table(2, :)) - top
            if (above <= most_heights*height) cycle
            call messages%add(severity%warning, title_of(water, g)//': the table lies up to '// &
               parameters%shown(above, 'length', 4)//' above the top of the model, y = '// &
               parameters%shown(top, 'length', 6)//', which is '//parameters%shown(height, 'length', 4)// &
               ' high: is y of the table right? (Rock above the model is a stress of &in_situ and a traction)', &
               water%origin)
         end associate
      end do
   end subroutine check_water_tables

   !> A note on displacements that are reset where there are none.
   subroutine check_first_reset(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      if (.not. allocated(parameters%stages)) return
      if (size(parameters%stages) == 0) return
      if (parameters%stages(1)%reset_displacement) call messages%add(severity%note, 'reset_displacement has no '// &
         'effect in the first stage: displacements count from the start of a stage. To leave out those of this '// &
         'stage, give it to the next one', parameters%stages(1)%origin)
   end subroutine check_first_reset

   !> A warning for each splinter, with number, place and thickness; one for all in a run.
   subroutine check_splinters(blocks, units, messages)
      type(block_system_type), intent(in) :: blocks
      character(len=*), intent(in) :: units                !! name of the system
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      real(wp) :: area(blocks%n_blocks), thickness(blocks%n_blocks), centroid(2, blocks%n_blocks), moments(3)
      character(len=:), allocatable :: text
      integer, allocatable :: splinters(:)
      integer :: i, k, summary
      do i = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            call polygon_properties(v, area(i), centroid(:, i), moments)
            thickness(i) = inradius_bound(v)      ! of a strip
         end associate
      end do
      splinters = pack([(i, i=1, blocks%n_blocks)], thickness < thin*sqrt(sum(area)/blocks%n_blocks))
      if (size(splinters) == 0) return
      summary = 0
      if (size(splinters) > 1) then
         text = to_string(size(splinters))//' blocks are splinters: '//described(splinters(1))
         do k = 2, min(most_named, size(splinters))
            text = text//', '//described(splinters(k))
         end do
         if (size(splinters) > most_named) text = text//" …; 'rockdda check' lists all"
         call messages%add_summary(severity%warning, size(splinters), text, origin, summary)
      end if
      do k = 1, size(splinters)
         call messages%add(severity%warning, 'block '//described(splinters(k))//': a splinter between joints that '// &
                           'nearly coincide; move one of them onto the other, or raise the edge-node distance e0', &
                           origin, summary)
      end do

   contains

      !> "7 at (1.5, 2) is 0.003 thick".
      function described(i) result(words)
         integer, intent(in) :: i
         character(len=:), allocatable :: words
         type(unit_system_type) :: u
         u = unit_system(units)
         words = to_string(i)//' at ('//to_string(centroid(1, i), 5)//', '//to_string(centroid(2, i), 5)//') is '// &
                 u%shown(thickness(i), 'length', 2)//' thick'
      end function described

   end subroutine check_splinters

end module rockdda_check_unlikely
