! SPDX-License-Identifier: MIT
!> Summary of `rockdda check`.
module rockdda_app_check_summary
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : counted
   use rockdda_model_bolt_layout, only : bolt_line_type
   use rockdda_model_bolt_numbers, only : bolt_numbers_type, numbers_of_bolt
   use rockdda_model_liner_layout, only : liner_layout_type, new_liner_layout, line_of_liner, lower_liner, &
      title_of_liner
   use rockdda_model_regions, only : blocks_of_region, has_region
   use rockdda_io_recognise, only : kind_name
   use rockdda_run_labelled_text, only : labelled_text
   use rockdda_run_input, only : model_input_type
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_facts, only : facts_type
   use rockdda_app_file_check, only : is_model_run
   use rockdda_app_json, only : json_type
   use rockdda_app_model_facts, only : describe_model, find_bolts
   use rockdda_app_process, only : argument_type, print_line
   use rockdda_app_report, only : begin_json, end_json
   implicit none
   private
   public :: print_summary

contains

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
      integer :: i, k, before
      call json%open('[', 'regions')
      do i = 1, size(input%options%regions)
         associate (regions => input%options%regions, name => input%options%regions(i)%name)
            if (any([(has_region(regions(k:k), name), k=1, i - 1)])) cycle
            inside = blocks_of_region(input%blocks, regions, name)
            call json%open('{', '')
            call json%put('name', trim(adjustl(name)))
            call json%open('[', 'blocks')
            before = 0
            do k = 1, size(inside)
               if (.not. inside(k) .or. number_of(k) == before) cycle
               before = number_of(k)
               call json%put('', before)
            end do
            call json%close(']')
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

end module rockdda_app_check_summary
