! SPDX-License-Identifier: MIT
!> Facts about the model of a run, for `rockdda check`: what an engineer reads before the run.
module rockdda_app_model_facts
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_bolt_layout, only : bolt_line_type, bolt_lines
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_automatic_stiffness, only : all_stiffenings, stiffness_range
   use rockdda_model_contact_numbers, only : mean_edge
   use rockdda_model_units, only : unit_system
   use rockdda_model_survey, only : survey_type, survey_model, unit_weight_of, joint_strength
   use rockdda_run_input, only : model_input_type
   use rockdda_app_facts, only : facts_type
   implicit none
   private
   public :: describe_model, find_bolts

   !> Digits of lengths, areas and stresses.
   integer, parameter :: digits = 4

contains

   !> Find the facts of a model that was read without errors.
   subroutine describe_model(input, plain, facts)
      type(model_input_type), intent(in) :: input
      logical, intent(in) :: plain              !! numbers as they are in texts, too
      type(facts_type), intent(inout) :: facts
      type(survey_type) :: survey
      type(bolt_line_type), allocatable :: lines(:)
      if (input%blocks%n_blocks == 0) return
      survey = survey_model(input%blocks, input%parameters)
      call find_bolts(input, lines)
      associate (s => survey)
         facts%title = input%model_file
         facts%system = unit_system(input%parameters%units)
         call facts%add('title', input%parameters%title)
         call facts%add('units', facts%system%description())
         if (plain) facts%system = unit_system('none')
         call facts%add('blocks', input%blocks%n_blocks)
         call facts%add('width', s%x_max - s%x_min, 'length')
         call facts%add('height', s%y_max - s%y_min, 'length')
         call facts%add('area', s%area, 'length^2')
         call facts%add('smallest_block_area', s%smallest_area, 'length^2')
         call facts%add('smallest_block', 'block '//to_string(s%smallest_block)//' at '//place(s%smallest_place))
         call facts%add('mean_block_area', s%mean_area, 'length^2')
         call facts%add('largest_block_area', s%largest_area, 'length^2')
         call facts%add('shortest_edge', s%shortest_edge, 'length')
         call facts%add('mean_edge', s%mean_edge, 'length')
         call facts%add('smallest_angle', s%smallest_angle, 'deg')
         call facts%add('smallest_angle_of', 'block '//to_string(s%angle_block)//' at '//place(s%angle_place))
         call facts%add('fixed_points', input%blocks%fixed%n)
         call facts%add('loading_points', input%blocks%loading%n)
         call facts%add('measured_points', input%blocks%measured%n)
         call facts%add('bolts', input%blocks%bolts%n + size(lines))
      end associate
      call describe_materials(input, survey, facts)
      call describe_numbers(input, facts)
   end subroutine describe_model

   !> The bolts that have nodes, as they are drawn.
   subroutine find_bolts(input, lines)
      type(model_input_type), intent(in) :: input
      type(bolt_line_type), allocatable, intent(out) :: lines(:)
      integer :: i
      allocate (lines(0))
      if (.not. allocated(input%options%bolts)) return
      if (any([(len(bolt_problem(input%options%bolts(i))) > 0, i=1, size(input%options%bolts))])) return
      call bolt_lines(input%options%bolts, input%blocks, input%options%regions, input%options%stages, lines)
   end subroutine find_bolts

   !> Materials with what they bear under the weight of the model.
   subroutine describe_materials(input, survey, facts)
      type(model_input_type), intent(in) :: input
      type(survey_type), intent(in) :: survey
      type(facts_type), intent(inout) :: facts
      character(len=:), allocatable :: text
      integer :: i
      associate (p => input%parameters, u => facts%system)
         do i = 1, size(p%block_materials)
            associate (m => p%block_materials(i))
               text = name_of(m%name)//counted(survey%blocks_of(i), 'block')//', unit weight '// &
                      u%shown(unit_weight_of(p, i), 'force/length^2')//', E '//u%shown(m%youngs_modulus, 'stress')
               if (unit_weight_of(p, i) > 0) text = text//', E over the stress at the base '// &
                  to_string(m%youngs_modulus/max(survey%base_stress, tiny(1.0_wp)), 2)
               if (any(abs([m%stress, m%stress_gradient]) > 0)) text = text//', s11 s22 at the base '// &
                  u%shown(m%stress(1) + m%stress_gradient(1)*survey%y_min, 'stress')//' '// &
                  u%shown(m%stress(2) + m%stress_gradient(2)*survey%y_min, 'stress')
               if (survey%blocks_of(i) > 0 .or. len(name_of(m%name)) > 0) &
                  call facts%add('block_material_'//to_string(i), text)
            end associate
         end do
         call facts%add('stress_at_the_base', survey%base_stress, 'stress')
         do i = 1, size(p%joint_materials)
            associate (m => p%joint_materials(i))
               text = name_of(m%name)//'length '//u%shown(survey%joint_length(i), 'length')//', friction '// &
                      u%shown(m%friction_angle, 'deg')//trim(merge('    ', ' deg', u%is_known()))// &
                      ', cohesion '//u%shown(m%cohesion, 'stress')// &
                      ', tension '//u%shown(m%tension, 'stress')//'; shear strength under the stress at half depth '// &
                      u%shown(joint_strength(m, 0.5_wp*survey%base_stress), 'stress')//', at the base '// &
                      u%shown(joint_strength(m, survey%base_stress), 'stress')
               if (survey%joint_length(i) > 0 .or. len(name_of(m%name)) > 0) &
                  call facts%add('joint_material_'//to_string(i), text)
            end associate
         end do
      end associate
   end subroutine describe_materials

   !> Numbers with which the run begins. Those that the program chose have a note with the reason.
   subroutine describe_numbers(input, facts)
      type(model_input_type), intent(in) :: input
      type(facts_type), intent(inout) :: facts
      associate (p => input%parameters)
         call facts%add('plane', trim(merge('strain', 'stress', p%plane_strain)))
         call facts%add('formulation', trim(merge('length', 'vertex', p%by_length)))
         call facts%add('w0', p%w0, 'length')
         call facts%add('displacement_ratio', p%displacement_ratio)
         call facts%add('displacement_of_a_step', p%displacement_ratio*p%w0, 'length')
         call facts%add('time_step', p%dt_max, 'time')
         call facts%add('smallest_time_step', p%dt_min, 'time')
         call facts%add('contact_stiffness', p%normal_stiffness, 'force/length')
         if (p%stiffness_length > 0) then
            call facts%add('joint_stiffness', p%normal_stiffness/mean_edge(input%blocks)* &
                           merge(1.0_wp, 2.0_wp, p%by_length), 'stress/length')
         else
            associate (range => stiffness_range(all_stiffenings(input%blocks, p)))
               call facts%add('least_joint_stiffness', range(1), 'stress/length')
               call facts%add('largest_joint_stiffness', range(2), 'stress/length')
            end associate
         end if
         call facts%add('contact_search_distance', p%search_distance, 'length')
         call facts%add('k01', p%k01)
         call facts%add('stages', size(p%stages))
         if (p%n_steps < huge(1)) call facts%add('steps', p%n_steps)
         if (p%t_end < huge(1.0_wp)) call facts%add('end_time', p%t_end, 'time')
      end associate
   end subroutine describe_numbers

   !> "limestone: ", or nothing.
   pure function name_of(name) result(text)
      character(len=:), allocatable, intent(in) :: name
      character(len=:), allocatable :: text
      text = ''
      if (.not. allocated(name)) return
      if (len(name) > 0) text = name//': '
   end function name_of

   !> "(x, y)"
   pure function place(point) result(text)
      real(wp), intent(in) :: point(2)
      character(len=:), allocatable :: text
      text = '('//to_string(point(1), digits)//', '//to_string(point(2), digits)//')'
   end function place

end module rockdda_app_model_facts
