! SPDX-License-Identifier: MIT
!> rockdda check: every problem of every file, and what an engineer reads before the run; computes nothing.
!>
!> Checks of `rockdda check`: files of one run together, and one file by itself.
module rockdda_app_command_check
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity, origin_type
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_io_option_documents, only : options_markdown, options_schema
   use rockdda_io_recognise, only : file_kind, kind_name, ddaml_advice
   use rockdda_run_labelled_text, only : labelled_text
   use rockdda_run_find_files, only : holds_groups, no_groups, recognise_file
   use rockdda_run_input, only : model_input_type
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_conversion, only : list_files
   use rockdda_app_process, only : argument_type, add_argument, print_line
   use rockdda_app_report, only : show_messages, show_error, begin_json, end_json
   use rockdda_app_facts, only : facts_type
   use rockdda_app_json, only : json_type
   use rockdda_model_bolt_layout, only : bolt_line_type, bolt_lines
   use rockdda_model_bolt_numbers, only : bolt_numbers_type, numbers_of_bolt, bolt_problem
   use rockdda_model_liner_layout, only : liner_layout_type, new_liner_layout, line_of_liner, lower_liner, &
      title_of_liner
   use rockdda_model_regions, only : blocks_of_region, has_region
   use rockdda_model_automatic_numbers, only : all_stiffenings, stiffness_range
   use rockdda_model_contact_numbers, only : mean_edge
   use rockdda_model_units, only : unit_system
   use rockdda_model_survey, only : survey_type, survey_model, unit_weight_of, joint_strength
   use rockdda_lines_generate, only : generate_lines
   use rockdda_lines_report, only : lines_report_type
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_file_content, only : file_content_type
   use rockdda_run_checkpointing, only : check_checkpoint
   use rockdda_run_model_input, only : model_input_type, read_model
   implicit none
   private
   public :: run_check

   !> Digits of lengths, areas and stresses.
   integer, parameter :: digits = 4

contains

   !> Run the command; returns the exit code.
   subroutine run_check(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(argument_type), allocatable :: files(:)
      type(model_input_type) :: input
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      integer, allocatable :: kinds(:)
      integer :: i, least
      logical :: ok
      logical, allocatable :: readable(:)

      if (line%options_table) then
         call print_options(line%json, ok)
         exit_code = merge(0, error_code%output, ok)
         return
      end if
      call list_files(line, files, messages, error)
      if (len(line%config) > 0) call add_argument(line%config, files)
      allocate (kinds(size(files)), readable(size(files)))
      do i = 1, size(files)
         call recognise_file(files(i)%text, kinds(i), messages, readable(i))
      end do
      if (line%as_namelist .and. .not. is_model_run(kinds) .and. all(readable) .and. .not. allocated(error)) &
         call make_error(error, error_code%input, '--as-namelist needs the files of one run: a geometry or block '// &
                         'file, an analysis file and, where there is one, an options file; or a folder with them')
      if (is_model_run(kinds)) then
         call check_together(line, files, kinds, input, messages, error)
         readable = readable .and. .not. (is_input(kinds) .or. kinds == file_kind%labelled)
      end if
      do i = 1, size(files)
         if (readable(i) .and. .not. line%as_namelist) call check_alone(line, files(i)%text, kinds(i), &
            any(is_input(kinds) .and. kinds /= file_kind%options), messages)
      end do
      exit_code = 0
      if (messages%has_errors() .or. allocated(error)) exit_code = error_code%input
      least = severity%note
      if (line%as_namelist) least = severity%warning
      if (line%quiet .or. line%json) least = severity%error
      call show_messages(messages, least)
      if (allocated(error)) call show_error(error)
      if (line%as_namelist .and. .not. line%json) then
         if (exit_code /= 0) return
         call print_line(labelled_text(input), ok)
         if (.not. ok) exit_code = error_code%output
         return
      end if
      call print_summary(line, files, kinds, input, messages, error, exit_code, ok)
      if (.not. ok) exit_code = error_code%output
   end subroutine run_check

   !> Print the table of options of a run: Markdown, or with --json a JSON Schema.
   subroutine print_options(json, ok)
      logical, intent(in) :: json
      logical, intent(out) :: ok
      character(len=:), allocatable :: text
      if (json) then
         text = options_schema()
      else
         text = options_markdown()
      end if
      call print_line(text(:len(text) - 1), ok)
   end subroutine print_options

   !> Print the summary.
   subroutine print_summary(line, files, kinds, input, messages, error, exit_code, ok)
      type(command_line_type), intent(in) :: line
      type(argument_type), intent(in) :: files(:)
      integer, intent(in) :: kinds(:)
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(in) :: error
      integer, intent(in) :: exit_code
      logical, intent(out) :: ok
      type(json_type) :: json
      type(facts_type) :: facts
      integer :: i, n_errors
      if (exit_code == 0 .and. is_model_run(kinds)) call describe_model(input, line%json, facts)
      if (line%json) then
         call begin_json(json, line, trim(merge('done ', 'error', exit_code == 0)), exit_code)
         call json%open('[', 'files')
         do i = 1, size(files)
            call json%open('{', '')
            call json%put('file', files(i)%text)
            call json%put('kind', kind_name(kinds(i)))
            call json%close('}')
         end do
         call json%close(']')
         if (facts%n > 0) call facts%to_json(json, 'model')
         if (exit_code == 0 .and. is_model_run(kinds)) then
            call list_regions(input, json)
            call list_bolts(input, json)
            call list_liners(input, json)
         end if
         if (line%as_namelist .and. exit_code == 0) call json%put('namelist', labelled_text(input))
         call end_json(json, messages, error, ok)
         return
      end if
      if (facts%n > 0 .and. .not. line%quiet) call print_line(facts%to_text(), ok)
      n_errors = messages%n_errors + merge(1, 0, allocated(error))
      ok = .true.
      if (size(files) == 0 .and. allocated(error)) return
      call print_line(counted(size(files), 'file')//' checked: '//counted(n_errors, 'error')//', '// &
               counted(messages%n_warnings, 'warning'), ok)
   end subroutine print_summary

   !> The blocks of each region, by the numbers that they have before some are cut into cells.
   subroutine list_regions(input, json)
      type(model_input_type), intent(in) :: input
      type(json_type), intent(inout) :: json
      logical, allocatable :: inside(:)
      integer, allocatable :: numbers(:)
      integer :: i, k
      call json%open('[', 'regions')
      do i = 1, size(input%options%regions)
         associate (regions => input%options%regions, name => input%options%regions(i)%name)
            if (any([(has_region(regions(k:k), name), k=1, i - 1)])) cycle
            inside = blocks_of_region(input%blocks, regions, name)
            call json%open('{', '')
            call json%put('name', trim(adjustl(name)))
            ! the cells of a block lie one after another
            numbers = pack([(number_of(k), k=1, size(inside))], inside)
            call json%put('blocks', pack(numbers, numbers /= eoshift(numbers, -1)))
            call json%close('}')
         end associate
      end do
      call json%close(']')

   contains

      !> Number of the block that a cell was cut from.
      pure integer function number_of(cell)
         integer, intent(in) :: cell
         number_of = cell
         if (allocated(input%blocks%parent)) number_of = input%blocks%parent(cell)
      end function number_of

   end subroutine list_regions

   !> Head and toe of each bolt of a group, as it is drawn, and the largest distance of nodes in grout; 0: none.
   subroutine list_bolts(input, json)
      type(model_input_type), intent(in) :: input
      type(json_type), intent(inout) :: json
      type(bolt_line_type), allocatable :: lines(:)
      type(bolt_numbers_type) :: numbers
      integer :: l
      call find_bolts(input, lines)
      call json%open('[', 'bolts')
      do l = 1, size(lines)
         call json%open('{', '')
         call json%put('name', lines(l)%name)
         call json%put('ends', [lines(l)%head, lines(l)%toe])
         numbers = numbers_of_bolt(input%options%bolts(lines(l)%group), norm2(lines(l)%toe - lines(l)%head))
         call json%put('group', lines(l)%group)
         call json%put('element', numbers%element)
         call json%close('}')
      end do
      call json%close(']')
   end subroutine list_bolts

   !> Largest distance of nodes of each lining; 0: those of the lining on which it lies.
   subroutine list_liners(input, json)
      type(model_input_type), intent(in) :: input
      type(json_type), intent(inout) :: json
      type(liner_layout_type) :: layout
      integer :: k
      call json%open('[', 'liners')
      associate (options => input%options)
         do k = 1, size(options%liners)
            layout = new_liner_layout(line_of_liner(options%liners, k, input%blocks, options%regions), &
                                      options%liners(k)%thickness, options%liners(k)%element)
            call json%open('{', '')
            call json%put('name', title_of_liner(options%liners(k), k))
            call json%put('element', merge(layout%largest, 0.0_wp, lower_liner(options%liners, k) == 0))
            call json%close('}')
         end do
      end associate
      call json%close(']')
   end subroutine list_liners

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

   !> Are among these the files of one run: a geometry or block file, an analysis file, at most one options file; or one
   !> labelled file alone?
   pure logical function is_model_run(kinds)
      integer, intent(in) :: kinds(:)
      is_model_run = count(kinds == file_kind%geometry .or. kinds == file_kind%blocks) == 1 .and. &
                     count(kinds == file_kind%analysis) == 1 .and. count(kinds == file_kind%options) <= 1 .and. &
                     count(kinds == file_kind%labelled) == 0
      is_model_run = is_model_run .or. (count(kinds == file_kind%labelled) == 1 .and. .not. any(is_input(kinds)))
   end function is_model_run

   !> Is this kind of file input of a run?
   elemental logical function is_input(kind)
      integer, intent(in) :: kind
      is_input = kind == file_kind%geometry .or. kind == file_kind%blocks .or. kind == file_kind%analysis .or. &
                 kind == file_kind%options
   end function is_input

   !> Check the files of one run, also for consistency.
   subroutine check_together(line, files, kinds, input, messages, error)
      type(command_line_type), intent(in) :: line
      type(argument_type), intent(in) :: files(:)
      integer, intent(in) :: kinds(:)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(simulation_type) :: sim
      integer :: i
      input%config_file = ''
      input%model_file = ''
      input%analysis_file = ''
      do i = 1, size(files)
         if (kinds(i) == file_kind%analysis) then
            input%analysis_file = files(i)%text
         else if (kinds(i) == file_kind%options) then
            input%config_file = files(i)%text
         else if (kinds(i) == file_kind%labelled) then
            input%labelled = .true.
            input%config_file = files(i)%text
         else if (is_input(kinds(i))) then
            input%model_file = files(i)%text
            input%model_kind = kinds(i)
         end if
      end do
      call read_model(line, input, messages, error)
      ! errors that a run would report before its first step
      if (.not. allocated(error) .and. .not. messages%has_errors()) call sim%init(input%blocks, input%parameters, error)
   end subroutine check_together

   !> Check one file by itself.
   subroutine check_alone(line, path, kind, has_model, messages)
      type(command_line_type), intent(in) :: line
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind                  !! one of file_kind%...
      logical, intent(in) :: has_model             !! files of a model that options may belong to are checked, too
      type(diagnostics_type), intent(inout) :: messages
      type(argument_type) :: file(1)
      type(model_input_type) :: input
      type(file_content_type) :: content
      type(cut_report_type) :: report
      type(lines_report_type) :: lines
      type(error_type), allocatable :: error
      type(origin_type) :: origin
      if (kind == file_kind%labelled) then
         file(1)%text = path
         call check_together(line, file, [file_kind%labelled], input, messages, error)
         if (allocated(error)) call messages%add_error(error)
         return
      end if
      call content%read(path, kind, line%dialect, [-1, -1], messages)
      if (.not. content%valid) return
      origin%file = path
      select case (kind)
      case (file_kind%options)
         if (.not. (has_model .or. holds_groups(path))) call messages%add(severity%error, no_groups, origin)
      case (file_kind%geometry)
         content%geometry%allow_open = line%allow_open
         call cut_blocks(content%geometry, content%blocks, report, messages, error)
         if (allocated(error)) call messages%add_error(error)
      case (file_kind%statistics)
         call generate_lines(content%statistics, content%geometry, lines, messages)
      case (file_kind%checkpoint)
         call check_checkpoint(path, messages)
      case (file_kind%ddaml)
         call messages%add(severity%error, ddaml_advice, origin)
      case (file_kind%unknown)
         call messages%add(severity%error, 'this version cannot check this file, it is of the kind: '// &
                           kind_name(kind), origin)
      end select
   end subroutine check_alone

end module rockdda_app_command_check
