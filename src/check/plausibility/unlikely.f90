! SPDX-License-Identifier: MIT
!> What a model has that hardly can be meant: splinters (blocks far thinner than the others, as joints that nearly
!> coincide cut them off), a surcharge that no traction carries, a reset of nothing, an acceleration as a factor on the
!> weight, joints that no test gives, water far above.
!>
!> What cannot be in the units of a model and is not in its options: the extent of the geometry,
!> a gravity that is too large for it, and the values of an
!> analysis file that a labelled file names.
module rockdda_check_unlikely
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : at_word, diagnostics_type, severity, origin_type
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : is_set, run_options_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_water_check, only : title_of
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_geometry_polygons, only : inradius_bound, polygon_properties
   use rockdda_model_possible_values, only : known_values_type, centrifuge
   implicit none
   private
   public :: check_ground, check_units

   !> A splinter is thinner than this share of the side of a square of the mean area.
   real(wp), parameter :: thin = 0.0025_wp
   !> Largest number of splinters named in the summary.
   integer, parameter :: most_named = 3

   !> Tractions that differ from the stress under the surface by less are rounded.
   real(wp), parameter :: rounding = 0.02_wp
   !> Largest factor on the weight that is no acceleration by mistake.
   real(wp), parameter :: largest_factor = 3.0_wp
   !> Joint roughness coefficient of the roughest profile of Barton and Choubey (1977).
   real(wp), parameter :: roughest = 20.0_wp
   !> Heights of the model by which water may stand above it.
   real(wp), parameter :: most_heights = 2

   !> Largest extent of a model: specimens of a laboratory to a mountain range [m].
   real(wp), parameter :: possible_extent(2) = [1.0e-4_wp, 2.0e5_wp]
   !> The largest models in a centrifuge [m].
   real(wp), parameter :: box_of_centrifuge = 3.0_wp

contains

   !> All of them.
   subroutine check_ground(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      call check_splinters(blocks, parameters%units, messages)
      call check_surcharge(blocks, parameters, messages)
      call check_first_reset(parameters, messages)
      call check_weight_factors(parameters, messages)
      call check_strength(blocks, parameters, messages)
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

   !> Warn of factors on the weight that seem to be accelerations.
   subroutine check_weight_factors(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (.not. allocated(parameters%stages)) return
      do i = 1, size(parameters%stages)
         associate (stage => parameters%stages(i))
            if (stage%gravity <= largest_factor) cycle
            call messages%add(severity%warning, '&stage: gravity = '//to_string(stage%gravity)//' is a factor on '// &
                              'the weight, not an acceleration: blocks weigh '//to_string(stage%gravity, 4)// &
                              ' times as much in this stage; 1 is the weight of &load', &
                              at_word(stage%origin, 'gravity'))
         end associate
      end do
   end subroutine check_weight_factors

   !> Warn of joints that no test gives: too rough, or with a tension beyond the apex of the line of Mohr and Coulomb,
   !> where no shear strength is left.
   subroutine check_strength(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: tangent
      integer :: i
      do i = 1, size(parameters%joint_materials)
         if (.not. any(blocks%edge_joint == i)) cycle
         associate (m => parameters%joint_materials(i))
            if (m%jrc > roughest) call messages%add(severity%warning, 'joint material '//to_string(i)//': jrc = '// &
               to_string(m%jrc, 4)//': the roughest profile has '//to_string(roughest), m%origin)
            tangent = tan(m%friction_angle*pi/180)
            if (m%tie .or. .not. m%cohesion > 0) cycle
            if (m%tension*tangent <= (1 + rounding)*m%cohesion) cycle
            call messages%add(severity%warning, 'joint material '//to_string(i)//': tension = '// &
                              parameters%shown(m%tension, 'stress')//' is more than cohesion/tan(friction) = '// &
                              parameters%shown(m%cohesion/tangent, 'stress')//', where no shear strength is left', &
                              m%origin)
         end associate
      end do
   end subroutine check_strength

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

   !> Report what cannot be.
   subroutine check_units(blocks, parameters, options, analysis_file, options_file, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(run_options_type), intent(in) :: options
      character(len=*), intent(in) :: analysis_file, options_file   !! for messages
      type(diagnostics_type), intent(inout) :: messages
      call check_extent(blocks, parameters, options%geometry_origin, options_file, messages)
      call check_gravity(blocks, parameters, options%gravity_origin, messages)
      if (len(analysis_file) > 0) call check_analysis(parameters, analysis_file, messages)
   end subroutine check_units

   !> A model of this extent is drawn in another unit of length.
   subroutine check_extent(blocks, parameters, geometry_origin, options_file, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(origin_type), intent(in) :: geometry_origin
      character(len=*), intent(in) :: options_file
      type(diagnostics_type), intent(inout) :: messages
      type(unit_system_type) :: system
      type(origin_type) :: origin
      real(wp) :: extent
      system = unit_system(parameters%units)
      extent = maxval(maxval(blocks%vertices, dim=2) - minval(blocks%vertices, dim=2))
      if (.not. system%is_known()) return
      if (system%in_si(extent, 'length') >= possible_extent(1) .and. &
          system%in_si(extent, 'length') <= possible_extent(2)) return
      origin = geometry_origin
      if (origin%line == 0) origin%file = options_file
      call messages%add(severity%error, 'the model is '//to_string(extent, 6)//' '//system%unit_of('length')// &
         ' wide or high (units = '''//trim(system%name)//'''), which cannot be: possible are 0.1 mm to 200 km. Is '// &
         "the geometry drawn in another unit of length? (units = 'none' of &model takes any)", origin)
   end subroutine check_extent

   !> A model larger than a box of a centrifuge with more than the earth's gravity.
   subroutine check_gravity(blocks, parameters, origin, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(origin_type), intent(in) :: origin                       !! where it was read; empty: it was not
      type(diagnostics_type), intent(inout) :: messages
      type(unit_system_type) :: system
      real(wp) :: gravity, extent                                   !! [m/s2], [m]
      system = unit_system(parameters%units)
      if (.not. system%is_known() .or. origin%line == 0) return
      gravity = system%in_si(parameters%acceleration_of_gravity(), 'length/time^2')
      extent = system%in_si(maxval(maxval(blocks%vertices, dim=2) - minval(blocks%vertices, dim=2)), 'length')
      if (gravity <= centrifuge .or. extent <= box_of_centrifuge) return
      call messages%add(severity%warning, 'gravity = '// &
         parameters%shown(parameters%acceleration_of_gravity(), 'length/time^2')//' is '// &
         to_string(gravity/9.81_wp, 3)//' times that of the earth, as models have in a centrifuge, '// &
         'which are not '//to_string(extent, 3)//' m wide or high: is it in another unit?', origin)
   end subroutine check_gravity

   !> Values of an analysis file that a labelled file names: those of the options were judged where they were read.
   subroutine check_analysis(parameters, analysis_file, messages)
      type(parameters_type), intent(in) :: parameters
      character(len=*), intent(in) :: analysis_file
      type(diagnostics_type), intent(inout) :: messages
      type(known_values_type) :: known
      type(origin_type) :: origin
      integer :: i
      known%system = unit_system(parameters%units)
      origin%file = analysis_file
      do i = 1, size(parameters%block_materials)
         call known%begin_group()
         associate (m => parameters%block_materials(i))
            call judge('block_material', i, 'density', 'mass/length^2', m%density)
            call judge('block_material', i, 'young', 'stress', m%youngs_modulus)
            call judge('block_material', i, 'unit_weight', 'force/length^2', m%weight)
            call judge('block_material', i, 'stress', 'stress', maxval(abs(m%stress)))
            call judge('block_material', i, 'stress_gradient', 'stress/length', maxval(abs(m%stress_gradient)))
            call judge('block_material', i, 'velocity', 'length/time', maxval(abs(m%velocity(1:2))))
         end associate
      end do
      do i = 1, size(parameters%joint_materials)
         associate (m => parameters%joint_materials(i))
            call judge('joint_material', i, 'friction', 'deg', m%friction_angle)
            call judge('joint_material', i, 'cohesion', 'stress', m%cohesion)
            call judge('joint_material', i, 'tension', 'stress', m%tension)
         end associate
      end do

   contains

      !> One value.
      subroutine judge(group, number, name, dimension, value)
         character(len=*), intent(in) :: group, name, dimension
         integer, intent(in) :: number
         real(wp), intent(in) :: value
         character(len=:), allocatable :: problem
         logical :: unlikely
         call known%problem_of(group, name, dimension, value, .false., problem, unlikely)
         if (len(problem) > 0) call messages%add(merge(severity%warning, severity%error, unlikely), group//' '// &
                                                 to_string(number)//': '//name//': '//problem, origin)
      end subroutine judge

   end subroutine check_analysis

end module rockdda_check_unlikely
